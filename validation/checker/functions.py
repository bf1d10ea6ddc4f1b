"""Matrices as functions of the parameter on a piece of its range, and the proof that they are positive definite."""
import itertools
import math
from functools import reduce
from operator import add, mul

from flint import arb, arb_mat, ctx

ctx.prec = 64  # bits
HALVINGS = 8  # of a cell


class Refused(Exception):
    """The record does not prove what it says."""


def require(condition, why):
    if not condition:
        raise Refused(why)


def ball(fraction):
    return arb(fraction.numerator) / arb(fraction.denominator)


def unit(n, factor=1.0):
    return Sum.constant([[factor if i == j else 0.0 for j in range(n)] for i in range(n)])


class Sum:
    """Σ C t^j cos kρ (s = 0) or t^j sin kρ (s = 1): terms[j, k, s] = C, of one shape; exact zeros are left out."""

    def __init__(self, shape, terms):
        self.shape, self.terms = shape, {}
        for (j, k, s), c in terms.items():
            require((c.nrows(), c.ncols()) == shape, "matrices differ in size")
            if (k, s) != (0, 1) and not all(x.is_zero() for x in c.entries()):
                self.terms[j, k, s] = c

    @staticmethod
    def constant(rows):
        return Sum((len(rows), len(rows[0])), {(0, 0, 0): arb_mat(rows)})

    @staticmethod
    def of_terms(shape, pairs):
        terms = {}
        for key, c in pairs:
            terms[key] = terms[key] + c if key in terms else c
        return Sum(shape, terms)

    def __add__(self, other):
        require(self.shape == other.shape, "matrices differ in size")
        return Sum.of_terms(self.shape, [*self.terms.items(), *other.terms.items()])

    def times(self, factor):
        return Sum(self.shape, {key: c * arb(factor) for key, c in self.terms.items()})

    def __sub__(self, other):
        return self + other.times(-1)

    def __matmul__(self, other):
        require(self.shape[1] == other.shape[0], "matrices differ in size")
        pairs = []
        for ((i, k, s), left), ((j, l, r), right) in itertools.product(self.terms.items(), other.terms.items()):
            # cos cos, sin sin, sin cos and cos sin of k and l, by waves of k + l and k - l
            product, wave = left * right * arb(0.5), s ^ r
            for harmonic, sign in (k + l, -1 if s and r else 1), (k - l, -1 if r and not s else 1):
                sign = -sign if wave and harmonic < 0 else sign
                pairs.append(((i + j, abs(harmonic), wave), product * arb(sign)))
        return Sum.of_terms((self.shape[0], other.shape[1]), pairs)

    @property
    def t(self):
        return Sum(self.shape[::-1], {key: c.transpose() for key, c in self.terms.items()})

    def waves(self):
        """Terms of one without t, by (k, s)."""
        require(all(j == 0 for j, _, _ in self.terms), "it depends on more than ρ")
        return {(k, s): c for (_, k, s), c in self.terms.items()}

    def by_rho(self):
        """∂/∂ρ."""
        return Sum(self.shape, {(0, k, 1 - s): c * arb(k if s else -k) for (k, s), c in self.waves().items()})

    def rows(self, picked):
        pick = lambda c: arb_mat([c.tolist()[i] for i in picked])
        return Sum((len(picked), self.shape[1]), {key: pick(c) for key, c in self.terms.items()})

    def at(self, rho):
        values = (c * (rho * k).sin_cos()[1 - s] for (k, s), c in self.waves().items())
        return sum(values, arb_mat(*self.shape))

    def bound(self, i, j):
        """A bound on |entry| for all ρ: Σₖ √(cₖ² + sₖ²)."""
        size = lambda k, s: self.terms[0, k, s][i, j].abs_upper() if (0, k, s) in self.terms else arb(0)
        harmonics = {k for k, _ in self.waves()}
        return sum(((size(k, 0) ** 2 + size(k, 1) ** 2).sqrt().abs_upper() for k in harmonics), arb(0)).abs_upper()


def function(value, shape):
    """Σ fᵢ(ρ) Mᵢ as the record writes it."""
    pairs = []
    for basis, rows in zip(value["basis"], value["coefficients"], strict=True):
        require(basis["function"] in ("constant", "cos", "sin"), "only constants and harmonics are known")
        require(basis.get("parameter", 0) == 0 and basis.get("harmonic", 0) >= 0, "a harmonic is odd")
        pairs.append(((0, basis.get("harmonic", 0), int(basis["function"] == "sin")), arb_mat(rows)))
    return Sum.of_terms(shape, pairs)


def blocks(grid):
    """[[M₁₁, M₁₂, …], …] as one."""
    down, across = [row[0].shape[0] for row in grid], [block.shape[1] for block in grid[0]]
    zero = lambda i, j: [[arb(0)] * across[j]] * down[i]
    terms = {}
    for key in set().union(*(block.terms for row in grid for block in row)):
        part = lambda i, j: grid[i][j].terms[key].tolist() if key in grid[i][j].terms else zero(i, j)
        bands = ([part(i, j) for j in range(len(across))] for i in range(len(down)))
        terms[key] = arb_mat([sum(rows, []) for band in bands for rows in zip(*band)])
    return Sum((sum(down), sum(across)), terms)


def inverse_factor(m, n):
    """L⁻¹ of M ≈ LLᵀ in floating point; None if there is none."""
    dot, factor, columns = (lambda x, y: sum(map(mul, x, y))), [], []  # of L⁻¹, each from its diagonal on
    for i in range(n):
        row = []
        for j in range(i):
            row.append((m[i * n + j] - dot(row, factor[j])) / factor[j][j])
        pivot = m[i * n + i] - dot(row, row)
        if not 0.0 < pivot < math.inf:
            return None
        pivot = math.sqrt(pivot)
        for j, column in enumerate(columns):
            column.append(-dot(row[j:], column) / pivot)
        columns.append([1.0 / pivot])
        factor.append(row + [pivot])
    inverse = [[columns[j][i - j] if j <= i else 0.0 for j in range(n)] for i in range(n)]
    return arb_mat(inverse) if all(math.isfinite(x) for row in inverse for x in row) else None


def is_definite(entries, n, t=None):
    """Whether every symmetric matrix in the ball matrix is positive definite, shown with T, or with one of its own."""
    t = inverse_factor([float(entry.mid()) for entry in entries], n) if t is None else t
    if t is None:
        return False
    off = (t * arb_mat(n, n, entries) * t.transpose()).entries()
    for i in range(n):
        off[i * n + i] -= 1
    return all(sum((x.abs_upper() for x in off[i * n : i * n + n]), arb(0)) < 1 for i in range(n))


class Family:
    """A symmetric matrix on a piece that starts at ρ = start. `assemble` makes it of the entries of `sums` and of what
    a cell carries; it is affine in the entries, and `constant` is 0 for an error of theirs."""

    def __init__(self, place, sums, assemble=lambda entries, extra, constant: entries):
        self.place, self.assemble = place, assemble
        self.keys = sorted(set().union(*(part.terms for part in sums)))
        entries = lambda part, key: part.terms[key].entries() if key in part.terms else [arb(0)] * mul(*part.shape)
        rows = [reduce(add, (entries(part, key) for part in sums)) for key in self.keys]
        self.coefficients = arb_mat(rows or [[0] * sum(mul(*part.shape) for part in sums)])

    def scalars(self, t, is_bend):
        """t^j cos kρ …, or their second derivatives, for t in a ball of the piece."""
        (start, omega), waves, values = self.place, {}, []
        for j, k, s in self.keys:
            if k not in waves:
                waves[k] = ((start + omega * t) * k).sin_cos()
            sine, cosine = waves[k]
            wave, slope = (sine, k * cosine) if s else (cosine, -k * sine)
            value = -((k * omega) ** 2) * t**j * wave if is_bend else t**j * wave
            if is_bend and j > 0:
                value += 2 * j * t ** (j - 1) * omega * slope
            if is_bend and j > 1:
                value += j * (j - 1) * t ** (j - 2) * wave
            values.append(value)
        return values or [arb(0)]

    def over(self, balls, is_bend):
        return (arb_mat([self.scalars(t, is_bend) for t in balls]) * self.coefficients).tolist()

    def is_definite_on(self, cells, halvings=HALVINGS):
        """Whether it is on every cell [a, b, extra] of t; cells follow each other."""
        values = self.over([arb(cells[0][0])] + [arb(b) for _, b, _ in cells], False)
        bends = self.over([arb((arb(a) + b) / 2, ((arb(b) - a) / 2).abs_upper()) for a, b, _ in cells], True)
        for (a, b, extra), left, right, bend in zip(cells, values, values[1:], bends):
            share = arb(-1, 1) * (arb(b) - a) ** 2 / 16  # [-(b - a)²/8, 0]
            error = self.assemble([share * x for x in bend], extra, 0)
            ends = [self.assemble(end, extra, 1) for end in (left, right)]
            n, middle = math.isqrt(len(error)), a + (b - a) / 2
            t = inverse_factor([float((x + y).mid()) / 2 for x, y in zip(*ends)], n)  # of halfway, which may do for both
            sums = ([x + e for x, e in zip(end, error)] for end in ends)
            if not all(any(is_definite(entries, n, x) for x in (t, None)) for entries in sums) and not (
                halvings > 0
                and a < middle < b
                and self.is_definite_on([[a, middle, extra], [middle, b, extra]], halvings - 1)
            ):
                return False
        return True

def bordered(base, push, difference):
    """Sums and their assembly to [M, δᵀ; δ, 4c], δ = g + cd for the rows g of `push`, d of `difference` and the numbers
    c > 0 of a cell. It is positive definite if M - Σ δᵢᵀδᵢ/4cᵢ is, and then xᵀMx > Σ θᵢ(dᵢx)(gᵢx) for all 0 ≤ θᵢ ≤ 1, because
    (dx)(gx) = (dx)(δx) - c(dx)² ≤ (δx)²/4c."""
    (rows, n) = push.shape

    def assemble(entries, c, constant):
        part = lambda first: [entries[n * (first + i) : n * (first + i + 1)] for i in range(rows)]
        delta = [[g + weight * d for g, d in zip(*pair)] for weight, pair in zip(c, zip(part(n), part(n + rows)))]
        top = [entries[n * i : n * i + n] + [row[i] for row in delta] for i in range(n)]
        corner = lambda i: [constant * 4 * c[i] if i == j else arb(0) for j in range(rows)]
        return sum(top + [row + corner(i) for i, row in enumerate(delta)], [])
    return [base, push, difference], assemble
