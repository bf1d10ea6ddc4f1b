"""Matrices as functions of the parameter on a piece of its range, and the proof that they are positive definite."""
import functools
import itertools
import math
from operator import mul

from flint import arb, arb_mat, ctx

ctx.prec = 64  # bits
HALVINGS = 8  # of a cell
ONE = (0, 0, 0, ())  # key of a constant


class Refused(Exception):
    """The record does not prove what it says."""


def require(condition, why):
    if not condition:
        raise Refused(why)


def is_zero(matrix):
    return all(map(arb.is_zero, matrix.entries()))


def diagonal(numbers):
    return arb_mat([[x if i == j else 0 for j in range(len(numbers))] for i, x in enumerate(numbers)])


@functools.cache
def unit(n):
    return diagonal([1] * n)


def blocks(grid):
    """[[M₁₁, M₁₂, …], …] as one."""
    return arb_mat([sum(rows, []) for band in grid for rows in zip(*(matrix.tolist() for matrix in band))])


class Sum:
    """Σ C t^j cos kρ ρᵢ… (s = 0) or t^j sin kρ ρᵢ… (s = 1): terms[j, k, s, (i, …)] = C, matrices of one shape.

    ρ is the parameter, ρᵢ are the shares of the vertices of a polytope, i, … in order.
    """

    def __init__(self, shape, pairs=()):
        self.shape, self.terms = shape, {}
        for key, c in pairs:
            require((c.nrows(), c.ncols()) == shape, "matrices differ in size")
            if key[1:3] != (0, 1):  # sin 0
                self.terms[key] = self.terms[key] + c if key in self.terms else c

    @staticmethod
    def constant(rows):
        matrix = arb_mat(rows)
        return Sum((matrix.nrows(), matrix.ncols()), [(ONE, matrix)])

    def map(self, change, shape=None):
        return Sum(shape or self.shape, ((key, change(c)) for key, c in self.terms.items()))

    def times(self, factor):
        return self.map(lambda c: c * arb(factor))

    @property
    def t(self):
        return self.map(lambda c: c.transpose(), self.shape[::-1])

    def rows(self, picked):
        return self.map(lambda c: arb_mat([c.tolist()[i] for i in picked]), (len(picked), self.shape[1]))

    def __add__(self, other):
        require(self.shape == other.shape, "matrices differ in size")
        return Sum(self.shape, [*self.terms.items(), *other.terms.items()])

    def __sub__(self, other):
        return self + other.times(-1)

    def __matmul__(self, other):
        require(self.shape[1] == other.shape[0], "matrices differ in size")
        pairs = []
        for ((i, k, s, v), left), ((j, l, r, w), right) in itertools.product(self.terms.items(), other.terms.items()):
            # cos cos, sin sin, sin cos and cos sin of k and l, by waves of k + l and k - l
            half, wave = left * right * arb(0.5), s ^ r
            for harmonic, sign in (k + l, -1 if s and r else 1), (k - l, -1 if r and not s else 1):
                sign = -sign if wave and harmonic < 0 else sign
                pairs.append(((i + j, abs(harmonic), wave, tuple(sorted(v + w))), half * arb(sign)))
        product = Sum((self.shape[0], other.shape[1]), pairs)
        return Sum(product.shape, [(key, c) for key, c in product.terms.items() if not is_zero(c)])

    def is_zero(self):
        return all(map(is_zero, self.terms.values()))

    def slope(self, of_t, of_rho):
        """of_t ∂/∂t + of_rho ∂/∂ρ."""
        pairs = []
        for (j, k, s, v), c in self.terms.items():
            pairs.append(((j, k, 1 - s, v), c * (arb(of_rho) * (k if s else -k))))
            if j > 0:
                pairs.append(((j - 1, k, s, v), c * (arb(of_t) * j)))
        return Sum(self.shape, pairs)

    def at(self, rho):
        """The value of one without t and vertices."""
        return sum((c * (rho * k).sin_cos()[1 - s] for (_, k, s, _), c in self.terms.items()), arb_mat(*self.shape))

    def bound(self, i, j):
        """A bound on |entry| for all ρ, of one without t and vertices: Σₖ √(cₖ² + sₖ²)."""
        squares = {}
        for (_, k, _, _), c in self.terms.items():
            squares[k] = squares.get(k, arb(0)) + c[i, j].abs_upper() ** 2
        return sum((square.sqrt() for square in squares.values()), arb(0)).abs_upper()

    def by_vertices(self, count, degree):
        """Σ ρᵢρⱼ Mᵢⱼ is a convex combination of all Mᵢᵢ and (Mᵢⱼ + Mⱼᵢ)/2: these. Lower terms are raised by Σρᵢ = 1."""
        found = {v: [] for v in itertools.combinations_with_replacement(range(count), degree)}
        for (j, k, s, v), c in self.terms.items():
            for more in itertools.product(range(count), repeat=degree - len(v)):
                place = tuple(sorted(v + more))
                found[place].append(((j, k, s, ()), c / len(set(itertools.permutations(place)))))
        return [Sum(self.shape, pairs) for pairs in found.values()]


def function(value, shape):
    """Σ fᵢ(ρ) Mᵢ as the record writes it."""
    pairs = []
    for basis, rows in zip(value["basis"], value["coefficients"], strict=True):
        require(basis["function"] in ("constant", "cos", "sin"), "only constants and harmonics are known")
        require(basis.get("parameter", 0) == 0 and basis.get("harmonic", 0) >= 0, "a harmonic is odd")
        pairs.append(((0, basis.get("harmonic", 0), int(basis["function"] == "sin"), ()), arb_mat(rows)))
    return Sum(shape, pairs)


def inverse_factor(matrix):
    """L⁻¹ of M ≈ LLᵀ, with L in floating point; None if there is none."""
    dot, factor = (lambda x, y: sum(map(mul, x, y))), []
    for i, entries in enumerate(matrix.tolist()):
        m, row = [float(entry.mid()) for entry in entries], []
        for j, other in enumerate(factor):
            row.append((m[j] - dot(row, other)) / other[j])
        square = m[i] - dot(row, row)
        if not 0.0 < square < math.inf:
            return None
        factor.append(row + [math.sqrt(square)])
    return arb_mat([row + [0.0] * (len(factor) - len(row)) for row in factor]).inv().mid()


def is_definite(m, t=None):
    """Whether every symmetric matrix in the ball matrix is positive definite, shown with T, or with one of its own."""
    t = inverse_factor(m) if t is None else t
    if t is None:
        return False
    off = (t * m * t.transpose() - unit(m.nrows())).tolist()
    return all(sum(map(arb.abs_upper, row)) < 1 for row in off)


class Family:
    """A symmetric matrix for every t of a piece: `finish`, which is concave, of `parts` and of what a cell carries."""

    def __init__(self, place, parts, finish):
        self.place, self.finish, self.shapes = place, finish, [part.shape for part in parts]
        bends = [part.slope(1, place[1]).slope(1, place[1]) for part in parts]
        self.itself, self.bend = self.table(parts), self.table(bends)

    def table(self, parts):
        """All keys of the parts, and of each a row with the coefficients of all entries."""
        keys = sorted({ONE}.union(*(part.terms for part in parts)))
        entries = lambda part, key: part.terms[key].entries() if key in part.terms else [0] * mul(*part.shape)
        return keys, arb_mat([sum((entries(part, key) for part in parts), []) for key in keys])

    def values(self, table, balls):
        """The matrices of the parts of a table at every t of `balls`, ρ = start + ωt."""
        (start, omega), (keys, coefficients), scalars = self.place, table, []
        for t in balls:
            powers = {j: t**j for j, *_ in keys}
            waves = {k: ((start + omega * t) * k).sin_cos() for _, k, *_ in keys}
            scalars.append([powers[j] * waves[k][1 - s] for j, k, s, _ in keys])
        ends = list(itertools.accumulate(itertools.starmap(mul, self.shapes), initial=0))
        rows = (arb_mat(scalars) * coefficients).tolist()
        return [[arb_mat(*shape, row[a:b]) for shape, a, b in zip(self.shapes, ends, ends[1:])] for row in rows]

    def is_definite_on(self, cells, halvings=HALVINGS):
        """Whether it is on every cell [a, b, extra] of t; cells follow each other."""
        ends = self.values(self.itself, [arb(cells[0][0]), *(arb(b) for _, b, _ in cells)])
        bends = self.values(self.bend, [arb(a).union(arb(b)) for a, b, _ in cells])
        for (a, b, extra), *two, bend in zip(cells, ends, ends[1:], bends):
            share, middle = arb(-1, 1) * (arb(b) - a) ** 2 / 16, a + (b - a) / 2  # [-(b - a)²/8, 0]
            both = [self.finish([x + y * share for x, y in zip(end, bend)], extra) for end in two]
            # what is made for halfway may do for both
            factors = [inverse_factor((both[0] + both[1]) * arb(0.5)), None] if extra else [None]
            if not all(any(is_definite(m, t) for t in factors) for m in both):
                halves = [[a, middle, extra], [middle, b, extra]]
                if halvings == 0 or not a < middle < b or not self.is_definite_on(halves, halvings - 1):
                    return False
        return True


def alone(parts, _):
    return parts[0]


def less_squares(parts, weights):
    """M - Σ δᵢᵀδᵢ/4cᵢ, δ = g + cd for the numbers c > 0 of a cell. Where it is positive definite, xᵀMx > Σ θᵢ(dᵢx)(gᵢx)
    for all 0 ≤ θᵢ ≤ 1, because (dx)(gx) = (dx)(δx) - c(dx)² ≤ (δx)²/4c."""
    base, push, difference = parts
    delta = push + diagonal(weights) * difference
    return base - delta.transpose() * diagonal([1 / (4 * arb(c)) for c in weights]) * delta
