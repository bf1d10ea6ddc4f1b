#!/usr/bin/env python3
"""Checks a proof record of lpv without lpv: `check.py RECORD [--design DESIGN.json] [--jobs N]`.

Everything is derived again from the numbers of the record: the plant's linearisation, the closed loop, the matrices
that have to be definite. Real numbers are balls of Arb (python-flint), whose radii hold every rounding. The method is
not that of lpv:

* Every matrix of a theorem is, on a piece of the parameter's range, a sum of constant matrices times t^j cos kρ and
  t^j sin kρ (`Sum`), ρ = low + ω (piece + t): gains are cubic splines in t, plant and Lyapunov matrix trigonometric
  polynomials in ρ. Such sums are added, multiplied and differentiated as they are.
* On a cell [a, b], entry by entry, M(t) = chord of M(a), M(b) + e with e in [-(b - a)²/8, 0]·M''(cell) (error of
  interpolation). If M(a) + e and M(b) + e are positive definite for all such e, so is every M(t), a convex
  combination of the two.
* A symmetric ball matrix N is positive definite if in TNTᵀ - I every row sums to less than 1 (Gershgorin); T is any
  matrix, here the inverse of a Cholesky factor in floating point.

A cell that is too wide for that is halved; one that is missing is refused. The last line says `accepted` only if
every claim holds.
"""
import argparse
import collections
import hashlib
import itertools
import json
import math
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from functools import reduce
from operator import add, mul

from flint import arb, arb_mat, ctx

ctx.prec = 64  # bits
HALVINGS = 8  # of a cell
SERIES = 24  # terms of the exponential series
# A quotient of parameters is meant exactly or as the double nearest to it: both are in this ball around it.
ROUNDED = arb(1, 2.0**-50)
FORMAT = "lpv proof record 1"


class Refused(Exception):
    """The record does not prove what it says."""


def require(condition, why):
    if not condition:
        raise Refused(why)

# ----------------------------------------------------------------------------------------------------------- the file

def load(text):
    """A line of JSON, in which no key stands twice and numbers are integers or hexadecimal floating point."""
    def no_twins(pairs):
        require(len({key for key, _ in pairs}) == len(pairs), "a key stands twice")
        return dict(pairs)

    def no_decimals(number):
        raise Refused(f"{number} is no exact number")
    return exact(json.loads(text, object_pairs_hook=no_twins, parse_float=no_decimals, parse_constant=no_decimals))


def exact(value):
    """Hexadecimal floating point to floats, in all of a value."""
    if isinstance(value, str) and value.lstrip("-").startswith("0x"):
        number = float.fromhex(value)
        require(math.isfinite(number) and number.hex() == value, f"{value} is not written as it should be")
        return number
    if isinstance(value, list):
        return [exact(item) for item in value]
    return {key: exact(item) for key, item in value.items()} if isinstance(value, dict) else value


def read(path):
    """Designs and claims of a record."""
    with open(path, "rb") as file:
        head, _, body = file.read().partition(b"\n")
    head = load(head)
    require(hashlib.sha256(body).hexdigest() == head["sha256"], "the digest is not that of the record")
    lines = [load(line) for line in body.splitlines()]
    require(head["format"] == FORMAT and head["lines"] == len(lines), "lines are missing, or of another format")
    designs, claims = ([line for line in lines if ("claim" in line) == is_claim] for is_claim in (False, True))
    require(lines == designs + claims and claims, "designs come first, then claims")
    for number, line in enumerate(designs):
        require(line.get("design", line.get("polytope")) == number, "designs are not numbered in turn")
    for number, line in enumerate(claims):
        require(line["claim"] == number and 0 <= line["design"] < len(designs), "claims are not numbered in turn")
        require(all(0 <= premise < number for premise in line["premises"]), "a premise is no earlier claim")
    return designs, claims


def symmetric(rows, size, what):
    require(len(rows) == size and all(len(row) == size for row in rows), f"{what} is not {size} × {size}")
    require(all(rows[i][j] == rows[j][i] for i in range(size) for j in range(i)), f"{what} is not symmetric")


def semidefinite(rows, strictly):
    """M ⪰ 0 (or ≻ 0), in rational numbers: no pivot of an elimination is negative, beside a zero one stand zeros."""
    m = [[Fraction(x) for x in row] for row in rows]
    for k in range(len(m)):
        if m[k][k] < 0 or (m[k][k] == 0 and (strictly or any(m[k][k + 1 :]))):
            return False
        for i in range(k + 1, len(m)):
            factor = m[i][k] / m[k][k] if m[k][k] else 0
            m[i] = [x - factor * y for x, y in zip(m[i], m[k])]
    return True


def check_weights(weights, n, m):
    symmetric(weights["q"], n, "Q"), symmetric(weights["r"], m, "R")
    require(semidefinite(weights["q"], False) and semidefinite(weights["r"], True), "Q is not ⪰ 0, or R not ≻ 0")
    return weights["q"], weights["r"]

# ----------------------------------------------------------------------------------- matrices as functions on a piece

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

# -------------------------------------------------------------------------------------------------- positive definite

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

# -------------------------------------------------------------------------------------------------------- the designs

def plant_of(plant):
    """A(ρ) = ∂f/∂x and B(ρ) = ∂f/∂u at rest, u*, and where ρ is in x; derived by hand from ẋ = f(x, u)."""
    if plant["name"] == "quadrotor":
        # v̇ = (sin θ, -sin φ cos θ, cos φ cos θ) ΣF/m - (0, 0, g), ṙ = v,
        # ṗ = (F₂ - F₄)ℓ/I_x - …qr, q̇ = (F₃ - F₁)ℓ/I_y - …pr, ṙ = (F₁ - F₂ + F₃ - F₄)d/I_z - …pq,
        # φ̇ = (p cos ψ - q sin ψ)/cos θ, θ̇ = p sin ψ + q cos ψ, ψ̇ = r - (p cos ψ - q sin ψ) tan θ; at rest F = mg/4
        axes = [f"inertia_{axis}_kg_m2" for axis in "xyz"]
        keys = ["mass_kg", "gravity_m_s2", *axes, "arm_length_m", "drag_to_lift_m"]
        require(all(plant[key] > 0 for key in keys), "a parameter of the quadrotor is not positive")
        mass, g, ix, iy, iz, arm, drag = (arb(plant[key]) for key in keys)
        g, by_mass, p, q, r = (ROUNDED * x for x in (g, 1 / mass, arm / ix, arm / iy, drag / iz))
        still = {(3, 0): arb(1), (4, 1): arb(1), (5, 2): arb(1), (11, 8): arb(1), (0, 10): g, (1, 9): -g}
        cosine, sine = {(9, 6): arb(1), (10, 7): arb(1)}, {(9, 7): arb(-1), (10, 6): arb(1)}
        b = {(2, i): by_mass for i in range(4)}
        b |= {(6, 1): p, (6, 3): -p, (7, 2): q, (7, 0): -q, (8, 0): r, (8, 1): -r, (8, 2): r, (8, 3): -r}
        fill = lambda entries, columns: arb_mat([[entries.get((i, j), 0) for j in range(columns)] for i in range(12)])
        a = {(0, 0, 0): fill(still, 12), (0, 1, 0): fill(cosine, 12), (0, 1, 1): fill(sine, 12)}
        hover = plant["mass_kg"] * plant["gravity_m_s2"] / 4
        return Sum((12, 12), a), Sum((12, 4), {(0, 0, 0): fill(b, 4)}), [hover] * 4, 11
    if plant["name"] == "linear":
        return Sum.constant(plant["A"]), Sum.constant(plant["B"]), [0.0] * len(plant["B"][0]), None
    # ẋ₁ = x₂, ẋ₂ = u; of the pendulum ẋ₂ = -0.1 x₂ + sin x₁ + u
    require(plant["name"] in ("pendulum", "double-integrator"), "the plant is not known")
    row = [1.0, -0.1] if plant["name"] == "pendulum" else [0.0, 0.0]
    return Sum.constant([[0.0, 1.0], row]), Sum.constant([[0.0], [1.0]]), [0.0], None


class Design:
    """The closed loop of a plant and a design, and V = xᵀPx or xᵀY⁻¹x."""

    def __init__(self, line):
        self.line, self.points, self.pieces, controller = line, line["points"], line["pieces"], line["controller"]
        self.a, self.b, trim, self.parameter = plant_of(line["plant"])
        (self.n, self.m), turns = self.b.shape, self.parameter is not None
        require(controller["operating_input"] == trim, "the operating input is not that of the plant")
        require(controller["scheduling_state"] == self.parameter, "the scheduling state is not that of the plant")
        self.q, self.r = check_weights(line["weights"], self.n, self.m)
        self.sigma = [self.room(controller["limits"], i) for i in range(self.m)]
        require(all(sigma is None or sigma >= 0 for sigma in self.sigma), "an input rests beyond its limits")
        # ρ = -π + ω t, t from 0 to the number of pieces, once around the circle
        require(0 < self.pieces <= 4096 if turns else self.pieces == len(self.points) == 1, "pieces are wrong")
        self.low, self.omega = (arb(-math.pi), 2 * arb.pi() / self.pieces) if turns else (arb(0), arb(0))
        self.check_schedule(controller["schedule"])
        moving, joined = line.get("rate_bounded"), line.get("joined")
        self.inverse = moving is not None
        point = lambda key: {"basis": [{"function": "constant"}], "coefficients": [self.points[0][key]]}
        given = (moving["y"], moving["l"]) if moving else (joined["p"], joined["auxiliary"]) if joined else (
            point("p"), point("auxiliary_gain"))
        for rows in given[0]["coefficients"]:
            symmetric(rows, self.n, "a matrix of the Lyapunov function")
        has_auxiliary = {p["auxiliary_gain"] is not None for p in self.points}
        require(len(has_auxiliary) == 1, "some auxiliary gains are missing")
        self.lyapunov = function(given[0], (self.n, self.n))
        self.low_gain = function(given[1], (self.m, self.n)) if True in has_auxiliary else None
        # inputs that lie between rows of F and K on the set, and those that could reach a limit
        self.saturating = [i for i in range(self.m) if self.low_gain and self.sigma[i] is not None]
        low = [self.gains(piece)[1] for piece in range(self.pieces)]
        self.limited = [i for i in range(self.m) if self.sigma[i] is not None and any(k.rows([i]).terms for k in low)]
        require(all(self.sigma[i] > 0 for i in self.limited), "an input that moves has no room")
        self.check_points()

    def room(self, limits, i):
        """σᵢ: |uᵢ - u*ᵢ| ≤ σᵢ is within the limits; None where there are none."""
        trim, least, most = self.line["controller"]["operating_input"][i], limits["min"][i], limits["max"][i]
        sides = [Fraction(trim) - Fraction(least)] if least is not None else []
        return min(sides + ([Fraction(most) - Fraction(trim)] if most is not None else []), default=None)

    def check_schedule(self, schedule):
        """Knots are where they should be, and gains at knots those of the points."""
        self.gain, gains, rhos = schedule, [p["gain"] for p in self.points], [p["rho"] for p in self.points]
        require(self.parameter is not None or rhos == [0.0], "there is no parameter")
        for k, rho in enumerate(rhos):
            off = arb(rho) - self.low - 2 * arb.pi() * k / len(rhos)
            require(off.abs_upper() < 1e-12, "a grid point is not where it should be")
        if schedule["kind"] == "grid":
            require(self.parameter is not None and len(gains) == self.pieces > 3, "the knots are wrong")
            require(abs(schedule["period"] - 2 * math.pi) < 1e-12, "the gains are not periodic")
            require(schedule["parameters"] == rhos, "knots differ from grid points")
            require(schedule["gains"] == gains, "scheduled gains differ from those of the grid points")
        elif schedule["kind"] == "constant":
            require([schedule["gain"]] == gains, "the gain differs from that of the point")
        else:
            require(schedule["kind"] == "vertices" and self.parameter is not None, "the schedule is not known")
            corners = itertools.product((-1.0, 1.0), repeat=len(schedule["weights"]["features"]))
            require(sorted(map(tuple, schedule["weights"]["corners"])) == list(corners), "they are no box's corners")
            for rho, gain in zip(rhos, gains):
                off, size = self.schedule(0).at(arb(rho)) - arb_mat(gain), max(abs(x) for row in gain for x in row)
                require(all(x.abs_upper() < 1e-3 * size for x in off.entries()), "the gain is far from the points'")

    def check_points(self):
        """P (and F) of the points is that of the function up to rounding: PY = I, or P and F have its harmonics."""
        for point in self.points:
            symmetric(point["p"], self.n, "P of a point")
            if self.inverse:
                off = self.lyapunov.at(arb(point["rho"])) * arb_mat(point["p"]) - unit(self.n).at(arb(0))
                require(all(x.abs_upper() < 1e-6 for x in off.entries()), "P of a point is not the inverse of Y")
        pairs = [(self.lyapunov, "p"), (self.low_gain, "auxiliary_gain")]
        for total, key in pairs if self.parameter is not None and not self.inverse else []:
            given, count = [arb_mat(p[key]) for p in self.points if total], len(self.points)
            for k, s in itertools.product(range((count - 1) // 2 + 1), (0, 1)) if total else []:
                waves = [(arb(p["rho"]) * k).sin_cos()[1 - s] for p in self.points]
                zero, weight = arb_mat(*total.shape), arb(2 if k else 1) / count
                off = sum((p * w for p, w in zip(given, waves)), zero) * weight - total.terms.get((0, k, s), zero)
                size = max(abs(x) for x in given[0].entries())
                require(all(x.abs_upper() < 1e-10 * size for x in off.entries()), "a harmonic is not the points'")

    def schedule(self, piece):
        """K on a piece: the cubic in t through the knots before, at both ends and after it; or Σ wᵢ(ρ)Kᵢ."""
        shape, schedule, total = (self.m, self.n), self.gain, Sum((self.m, self.n), {})
        if schedule["kind"] == "constant":
            return Sum.constant(schedule["gain"])
        if schedule["kind"] == "vertices":
            for corner, gain in zip(schedule["weights"]["corners"], schedule["gains"], strict=True):
                weight = unit(1)  # Π (1 + c feature)/2
                for c, feature in zip(corner, schedule["weights"]["features"], strict=True):
                    wave = (0, 1, {"cos": 0, "sin": 1}[feature])
                    weight @= Sum((1, 1), {(0, 0, 0): arb_mat([[0.5]]), wave: arb_mat([[c / 2]])})
                total += Sum(shape, {key: arb_mat(gain) * w[0, 0] for key, w in weight.terms.items()})
            return total
        for node in (-1, 0, 1, 2):
            weight = [Fraction(1)]  # Π (t - other)/(node - other), by powers of t
            for other in {-1, 0, 1, 2} - {node}:
                down, up = [x * -other for x in weight] + [0], [0] + weight
                weight = [Fraction(x + y, node - other) for x, y in zip(down, up)]
            gain = arb_mat(schedule["gains"][(piece + node) % self.pieces])
            total += Sum(shape, {(j, 0, 0): gain * ball(w) for j, w in enumerate(weight)})
        return total

    def place(self, piece):
        return self.low + self.omega * piece, self.omega

    def gains(self, piece):
        """K, and the rows that are not to saturate; both times Y in the inverse form."""
        k = self.schedule(piece) @ (self.lyapunov if self.inverse else unit(self.n))
        return k, blocks([[(self.low_gain if i in self.saturating else k).rows([i])] for i in range(self.m)])

    def definite(self, piece, floor=0.0):
        """P ≻ 0; or Y ⪰ floor I, which is P ⪯ I/floor."""
        if floor == 0.0 or self.inverse:
            return Family(self.place(piece), [self.lyapunov - unit(self.n, floor)])
        return Family(self.place(piece), [unit(self.n) - self.lyapunov.times(floor)])

    def unsaturated(self, piece, i, level):
        """[σ²/γ, f; fᵀ, P] ≻ 0, or the same with fY and Y: (fx)² < σ² where V ≤ γ."""
        row, corner = self.gains(piece)[1].rows([i]), arb_mat([[ball(self.sigma[i] ** 2) / arb(level)]])
        return Family(self.place(piece), [blocks([[Sum((1, 1), {(0, 0, 0): corner}), row], [row.t, self.lyapunov]])])

    def falling(self, piece, flying, rate, ratio):
        """-V̇ - ratio (xᵀQx + uᵀRu) > 0, input rows of K where they are `flying`, the others of F.

        V = xᵀPx:     -(P(A - BS) + ·ᵀ + ρ̇ P′) - ratio (Q + SᵀRS)
        V = xᵀY⁻¹x:   -(AY - BG + ·ᵀ) + ρ̇ Y′ - ratio (YQY + GᵀRG),  G = SY, between Y⁻¹

        With flying = "rows" an input is f x + θ(k - f)x, 0 ≤ θ ≤ 1, and θ² ≤ θ: the form is at least that of S = F less
        Σ θ (dᵢx)(gᵢx), d = k - f, g = ratio rᵢ(k + f) - 2bᵢᵀP (`bordered`).
        """
        w, q, r, (k, low) = self.lyapunov, Sum.constant(self.q), Sum.constant(self.r), self.gains(piece)
        of_k = lambda i: i not in self.saturating or (flying != "rows" and i in flying)
        s = blocks([[(k if of_k(i) else low).rows([i])] for i in range(self.m)])
        if self.inverse:
            flow, stage, motion = self.b @ s - self.a @ w, w @ q @ w + s.t @ r @ s, w.by_rho()
        else:
            flow, stage, motion = w @ (self.b @ s - self.a), q + s.t @ r @ s, w.by_rho().times(-1)
        base = flow + flow.t + motion.times(rate) - stage.times(ratio)
        if flying != "rows":
            return Family(self.place(piece), [base])
        require(all(self.r[i][j] == 0 for i in range(self.m) for j in range(i)), "R is not diagonal")
        push = (r @ (k + low)).times(ratio) - (self.b if self.inverse else w @ self.b).t.times(2)
        return Family(self.place(piece), *bordered(base, push.rows(self.saturating), (k - low).rows(self.saturating)))

    def held(self, time):
        """(AT)^k/(k + 1)!, k = 0, 1, …, with the rest of the series as the last: x(T) = x + TΦ(Ax + Bu) while u is held
        for T, where Φ is their sum."""
        terms, n = [unit(self.n)], self.n
        while terms[-1].terms and len(terms) <= SERIES:
            terms.append((terms[-1] @ self.a).times(arb(time) / (len(terms) + 1)))
        if terms[-1].terms:  # the rest is at most Σ_{k > N} a^k/(k + 1)! ≤ 2 a^{N+1}/(N + 2)! for the norm a ≤ N/2 of AT
            at = self.a.times(time).terms
            require(set(at) == {(0, 0, 0)}, "the series of a plant with a parameter does not end")
            norm = reduce(arb.max, (sum((x.abs_upper() for x in row), arb(0)) for row in at[0, 0, 0].tolist()))
            require(norm < SERIES / 2, "the sample time is too long")
            rest = arb(0, (2 * norm ** (SERIES + 1) / arb.fac_ui(SERIES + 2)).abs_upper())
            terms.append(Sum((n, n), {(0, 0, 0): arb_mat([[rest] * n] * n)}))
        return terms

    def kept(self, piece, time, between):
        """V is smaller at the next sample than at x, of every v between Fx and Kx that is held; one family for each φ.

        x(τ) = x + τE x, E = φ(A - BS), v = Sx. V(x(τ)) < V(x) is EᵀP + PE + τEᵀPE ≺ 0; by Schur, with H = PE (or EY),
        [-(H + Hᵀ), THᵀ; TH, TP] ≻ 0 is enough for τ ≤ T. It is affine in E and so in S: row i adds θ(uwᵀ + wuᵀ),
        u = (d, 0), w = (η, -Tη), η = Pφbᵢ, which is -θ(u·)(g·), g = -2w, as in `bordered`. At the sample φ = Φ. For all
        τ = sT, N = AT: φ = I + sN/2 + s²N²/6 + s³(…), by Bernstein's polynomials a convex combination of I, I + N/4 and
        I + N/2 + N²/6, and what follows, N^k s^k/(k + 1)!, is in [0, 1] N^k/(k + 1)!.
        """
        w, (k, low), terms = self.lyapunov, self.gains(piece), self.held(time)
        flow = (self.a @ w if self.inverse else self.a) - self.b @ low
        shares = [(0, 0), (0.5, 0), (1, 1)] if between else [(1, 1)]
        for share in shares:
            weights = [1, *share] + [arb(0.5, 0.5) if between else 1] * len(terms)
            phi = reduce(add, (term.times(weight) for term, weight in zip(terms, weights)))
            h, eta = (phi @ x if self.inverse else w @ phi @ x for x in (flow, self.b))
            base = blocks([[(h + h.t).times(-1), h.t.times(time)], [h.times(time), w.times(time)]])
            if not self.saturating:
                yield Family(self.place(piece), [base])
                continue
            push = blocks([[eta.t.times(-2), eta.t.times(2 * time)]]).rows(self.saturating)
            difference = blocks([[k - low, Sum((self.m, self.n), {})]]).rows(self.saturating)
            yield Family(self.place(piece), *bordered(base, push, difference))

    def sampled(self, piece, time):
        """With X of the cell: [-(EᵀX + XE), TEᵀX; TXE, TX] ≻ 0, so that X - (I + TE)ᵀX(I + TE) ≻ 0 and X ≻ 0.

        x₊ = (I + TE)x is the loop whose input is held for T: E = Φ(A - BK).
        """
        n = self.n

        def assemble(entries, x, constant):
            xe = x * arb_mat(n, n, entries)
            flow, side, corner = ((xe + xe.transpose()) * arb(-1), xe * arb(time), x * arb(time * constant))
            top = zip(flow.tolist(), side.transpose().tolist())
            return sum((left + right for left, right in itertools.chain(top, zip(side.tolist(), corner.tolist()))), [])
        return Family(self.place(piece), [reduce(add, self.held(time)) @ (self.a - self.b @ self.schedule(piece))], assemble)


class Polytope:
    """A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ; V = xᵀPx, u = -Σ ρᵢKᵢx, or V = xᵀ(Σ ρᵢYᵢ)⁻¹x, u = -(Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹x."""

    parameter = None

    def __init__(self, line):
        self.line, self.common, self.count = line, "P" in line, len(line["A"])
        self.n, self.m = len(line["B"][0]), len(line["B"][0][0])
        given = [line["P"]] * self.count if self.common else line["Y"]
        for rows in given:
            symmetric(rows, self.n, "P or Y")
        def all_of(matrices, rows, columns):
            each = [arb_mat(matrix) for matrix in matrices]
            require(len(each) == self.count, "a vertex is missing")
            require(all((x.nrows(), x.ncols()) == (rows, columns) for x in each), "a matrix is of another size")
            return each
        self.a, self.b = all_of(line["A"], self.n, self.n), all_of(line["B"], self.n, self.m)
        self.lyapunov = all_of(given, self.n, self.n)
        self.gain = all_of(line["K" if self.common else "L"], self.m, self.n)
        self.rates = [[0.0] * self.count] if self.common else line["rate_vertices"]
        for rates in self.rates:
            off = sum(map(Fraction, rates))
            require(len(rates) == self.count and abs(off) <= 1e-9 * max(map(abs, rates)), "rates do not sum to zero")
        require(self.rates, "rate vertices are missing")
        if line["weights"]:
            self.q, self.r = map(arb_mat, check_weights(line["weights"], self.n, self.m))
        self.sigma = line["sigma"] or [None] * self.m
        require(len(self.sigma) == self.m and all(s is None or s > 0 for s in self.sigma), "sigma is wrong")
        self.saturating = [i for i in range(self.m) if line["F"] and self.sigma[i] is not None]
        f = all_of(line["F"], self.m, self.n) if line["F"] else self.gain
        self.low = f if self.common or not line["F"] else [x * y for x, y in zip(f, self.lyapunov)]
        self.low = self.mixed(set(range(self.m)) - set(self.saturating))
        moves = lambda i: any(not x.is_zero() for k in self.low for x in k.tolist()[i])
        self.limited = [i for i in range(self.m) if self.sigma[i] is not None and moves(i)]

    def mixed(self, flying):
        """S at the vertices: rows of K or L where they are `flying`."""
        pick = lambda k, f: arb_mat([(k if i in flying else f).tolist()[i] for i in range(self.m)])
        return [pick(k, f) for k, f in zip(self.gain, self.low)]

    def matrices(self, claim):
        """All that have to be definite: Σ ρᵢρⱼ Mᵢⱼ ≻ 0 if every Mᵢᵢ ≻ 0 and Mᵢⱼ + Mⱼᵢ ≻ 0."""
        if claim["kind"] == "definite":
            yield from self.lyapunov
        elif claim["kind"] == "unsaturated":
            for i, (low, w) in itertools.product(self.limited, zip(self.low, self.lyapunov)):
                row, corner = low.tolist()[i], ball(Fraction(self.sigma[i]) ** 2) / arb(claim["level"])
                yield arb_mat([[corner] + row] + [[x] + y for x, y in zip(row, w.tolist())])
        else:
            others = set(range(self.m)) - set(self.saturating)
            pairs = list(itertools.combinations_with_replacement(range(self.count), 2))
            for chosen in itertools.product((False, True), repeat=len(self.saturating)):
                s = self.mixed(others | set(itertools.compress(self.saturating, chosen)))
                for rates, (i, j) in itertools.product(self.rates, pairs):
                    yield reduce(add, [self.pair(k, l, s, rates, claim) for k, l in {(i, j), (j, i)}])

    def pair(self, i, j, s, rates, claim):
        """Mᵢⱼ of -V̇ - (xᵀQx + uᵀRu)/factor, as `Design.falling`."""
        w = self.lyapunov
        flow = w[0] * (self.b[i] * s[j] - self.a[i]) if self.common else self.b[i] * s[j] - self.a[i] * w[j]
        m = reduce(add, (y * arb(rate) for rate, y in zip(rates, w)), flow + flow.transpose())
        if claim["kind"] == "cost":
            stage = s[i].transpose() * self.r * s[j] + (self.q if self.common else w[i] * self.q * w[j])
            m -= (stage + stage.transpose()) / (2 * arb(claim["factor"]))
        return m

# --------------------------------------------------------------------------------------------------------- the claims

def check_premises(claims, claim, design):
    """Whether a claim rests on earlier claims of the right kind, about the same design, level and rate."""
    kind, premises = claim["kind"], [claims[number] for number in claim["premises"]]
    require(sum((c["design"], c["kind"]) == (claim["design"], kind) for c in claims) == 1, "two claims are of one kind")
    limited = kind not in ("definite", "sampled") and bool(design.limited)
    falls = ["definite", "unsaturated"] if limited else ["definite"]
    needed = {"definite": [], "sampled": [], "unsaturated": ["definite"], "decrease": falls}
    # what V falls under for every v between Fx and Kx, it falls under for v = Kx
    needed |= {"cost": [*falls, "decrease"], "kept": falls, "sampled": ["kept"] if premises else []}
    require([premise["kind"] for premise in premises] == needed[kind], "it does not rest on what it has to")
    require(all(premise["design"] == claim["design"] for premise in premises), "a premise is of another design")
    if kind not in ("definite", "sampled"):
        require(claim["level"] > 0 if limited else claim["level"] is None, "it needs a level, or none")
        require(all(p["level"] == claim["level"] for p in premises[1:]), "a premise is about another level")
    require(kind != "cost" or claim["factor"] > 0, "the factor is not positive")
    if kind in ("decrease", "cost") and isinstance(design, Design):
        require(design.parameter is not None or claim["rate"] == 0, "there is no parameter that moves")
        require(claim["rate"] >= 0 and (kind != "cost" or premises[-1]["rate"] >= claim["rate"]), "the rate is wrong")
    is_sampled = kind in ("sampled", "kept")
    require(not is_sampled or claim["sample_time_s"] == design.line["sample_time_s"] > 0, "the sample time is wrong")


def check_cells(design, claim):
    """Whether the cells of every variant cover the range without gaps."""
    groups, variants = claim["groups"], design.limited if claim["kind"] == "unsaturated" else [None]
    if claim["kind"] == "sampled" and claim["premises"]:
        return require(not groups, "cells are of no use beside a premise")
    if claim["kind"] in ("decrease", "cost") and design.saturating:
        chosen = itertools.product((False, True), repeat=len(design.saturating))
        all_rows = [list(itertools.compress(design.saturating, bits)) for bits in chosen]
        variants = ["rows"] if groups[0]["variant"] == "rows" else all_rows
    expected = itertools.product(range(design.pieces), variants)
    require(sorted(map(str, expected)) == sorted(str((g["piece"], g["variant"])) for g in groups), "cells are missing")
    for group in groups:
        cells, piece = group["cells"], group["piece"]
        require(cells and cells[0][0] == piece and cells[-1][1] == piece + 1, "cells do not cover their piece")
        require(all(cell[0] < cell[1] for cell in cells), "a cell is empty")
        require(all(left[1] == right[0] for left, right in zip(cells, cells[1:])), "there is a gap between cells")
        has_more = claim["kind"] in ("sampled", "kept") or group["variant"] == "rows"
        require(all(len(cell) == 2 + has_more for cell in cells), "a cell has too little or too much")


def prove_group(design, claim, group, floor):
    """Whether a claim holds on the cells of a group; that P is definite, above a floor."""
    kind, piece, variant = claim["kind"], group["piece"], group["variant"]
    cells = [[cell[0] - piece, cell[1] - piece, cell[2] if cell[2:] else None] for cell in group["cells"]]
    if kind == "sampled":
        for cell in cells:
            symmetric(cell[2], design.n, "X")
            cell[2] = arb_mat(cell[2])
        family = design.sampled(piece, claim["sample_time_s"])
        return all(family.is_definite_on([cell]) for cell in cells)
    if variant == "rows" or kind == "kept":
        many = len(design.saturating)
        require(all(len(c) == many and min(c, default=1) > 0 for _, _, c in cells), "a weight of a row is not positive")
        cells = [[a, b, [arb(x) for x in c]] for a, b, c in cells]
    if kind == "kept":
        families = design.kept(piece, claim["sample_time_s"], claim["between"])
        return all(family.is_definite_on(cells) for family in families)
    if kind == "definite":
        return design.definite(piece, floor).is_definite_on(cells)
    if kind == "unsaturated":
        return design.unsaturated(piece, variant, claim["level"]).is_definite_on(cells)
    ratio = 1 / arb(claim["factor"]) if kind == "cost" else arb(0)
    rates = {-claim["rate"], claim["rate"]} if design.parameter is not None else {0.0}
    return all(design.falling(piece, variant, rate, ratio).is_definite_on(cells) for rate in rates)


def check_motion(designs, claims, claim):
    """Whether the reference of a governor moves as the model does, but for a disturbance that the sets absorb.

    x_ref = x₀ + Σ s⁽ᵏ⁾ Z_kΔ and u_ref = Σ s⁽ᵏ⁾ (U_k + ρ̇V_k)Δ leave w = Σ s⁽ᵏ⁺¹⁾ R_kΔ + ρ̇ Σ s⁽ᵏ⁾ S_kΔ,
    R_k = Z_k - AZ_{k+1} - BU_{k+1}, S_k = Z_k′ - BV_k. On V = γ: |2eᵀPw| ≤ 2√γ|w|/√y for Y ⪰ yI, and
    eᵀQe ≥ q|e|² ≥ qyγ for Q ⪰ qI, so that |w| < q y^{3/2} √γ/(2 factor) leaves {V ≤ γ} invariant. Each state moves
    alone, by at most `farthest`, ρ by half a turn.
    """
    outer, number = designs[claim["design"]], claim["design"]
    members = [outer] + [design for design in designs if design.line.get("inner_of") == number]
    supervisor, premises = outer.line["controller"]["supervisor"], [claims[k] for k in claim["premises"]]
    governor = supervisor["governor"]
    motion, states, rate = governor["motion"], governor["set_point_states"], governor["motion"]["parameter_rate"]
    costs = [("cost", member.line["design"]) for member in members]
    require([(p["kind"], p["design"]) for p in premises] == costs, "a member's cost is missing")
    require(governor["operating_state"] == [0.0] * outer.n, "the reference does not rest where the plant does")
    inner = [member.line["controller"]["schedule"] for member in members[1:]]
    require([member["schedule"] for member in supervisor["inner"]] == inner, "inner gains differ from those that fly")
    for member, premise in zip(members, premises):
        for key in ("plant", "weights"):
            require(member.line[key] == outer.line[key], f"a member has another {key}")
        for i, budget in enumerate(motion["input_budget"]):
            most = member.room(motion["actuators"], i)
            require(budget >= 0 and Fraction(budget) + member.sigma[i] <= most, "inputs exceed the actuators")
        require(premise["rate"] <= rate, "a member moves faster than the reference allows for")
    place = [[float(i == state) for state in states] for i in range(outer.n)]
    of = lambda functions, rows: [function(value, (rows, len(states))) for value in functions]
    z = [Sum.constant(place), *of(motion["states"], outer.n), Sum((outer.n, len(states)), {})]
    u, v = of(motion["inputs"], outer.m), of(motion["inputs_by_rate"], outer.m)
    v = v or [Sum((outer.m, len(states)), {})] * (len(u) - 1)
    require(len(z) == len(u) + 1 == len(v) + 2, "the chain of the motion is broken")
    require(not (outer.a @ z[0]).terms, "the plant does not rest wherever it is put")
    if outer.parameter is not None:
        off = function(motion["parameter_flow"], (1, outer.n)) - outer.a.rows([outer.parameter])
        require(all(off.bound(0, j) < 1e-12 for j in range(outer.n)), "the parameter moves otherwise")
    along = [z[k] - outer.a @ z[k + 1] - outer.b @ u[k] for k in range(len(u))]
    across = [z[k + 1].by_rho() - outer.b @ v[k] for k in range(len(v))] + [Sum(z[0].shape, {})]
    worst = arb(0)
    for j, state in enumerate(states):
        move = arb.pi() if state == outer.parameter else arb(claim["farthest"])
        # |s⁽ᵏ⁾| ≤ bₖ by the bounds on inputs, states and rate; a profile with lengths T₁ ≥ T₂ ≥ … has
        # |s⁽ᵏ⁾| ≤ pₖ = 1/(T₁⋯Tₖ) ≤ b_m^{k/m}, m ≥ k
        least = []
        for k in range(len(u)):
            turning = lambda i: rate * v[k].bound(i, j) if k < len(v) else 0
            used = [(u[k].bound(i, j) + turning(i), motion["input_budget"][i]) for i in range(outer.m)]
            bounded = [(i, bound) for i, bound in enumerate(motion["state_bounds"]) if bound is not None]
            used += [(z[k + 1].bound(i, j), bound) for i, bound in bounded]
            if k == 0 and state == outer.parameter and governor["parameter_rate"] is not None:
                used.append((arb(1), governor["parameter_rate"]))
            least.append(min((arb(bound) / (size * move) for size, bound in used if size > 0), default=None))
        peak = lambda k: min(least[m] ** (arb(k + 1) / (m + 1)) for m in range(k, len(u)) if least[m] is not None)
        # a derivative that nothing bounds has to move nothing
        times = lambda k, size: peak(k) * size if size > 0 else size
        both = lambda k, i: along[k].bound(i, j) + rate * across[k].bound(i, j)
        rows = (sum((times(k, both(k, i)) for k in range(len(u))), arb(0)) * move for i in range(outer.n))
        worst = worst.max(sum((row**2 for row in rows), arb(0)).abs_upper().sqrt())
    for premise, bound in zip(premises, claim["bounds"], strict=True):
        shift = lambda i, k: Fraction(outer.q[i][k]) - (Fraction(bound["q"]) if i == k else 0)
        shifted = [[shift(i, k) for k in range(outer.n)] for i in range(outer.n)]
        require(bound["q"] > 0 and bound["y"] > 0 and semidefinite(shifted, False), "Q is not above its bound")
        root = (arb(bound["y"]) ** 3 * arb(premise["level"])).sqrt()
        absorbed = arb(bound["q"]) * root / (2 * arb(premise["factor"]))
        require(worst < absorbed, f"the sets absorb {absorbed} and have to absorb {worst}")


def statement(claim):
    """The claim in words, from its own numbers."""
    on = f" on V <= {claim['level']!r}" if claim.get("level") is not None else ""
    return {
        "definite": "the Lyapunov matrix is positive definite",
        "unsaturated": f"the low gain does not saturate{on}",
        "decrease": f"V decreases{on} while the parameter's rate is at most {claim.get('rate')!r}",
        "cost": f"the cost is at most {claim.get('factor')!r} V(x(0)){on} while it is at most {claim.get('rate')!r}",
        "sampled": f"the loop sampled at T = {claim.get('sample_time_s')!r} s is stable at every fixed parameter",
        "kept": f"the saturated loop sampled at T = {claim.get('sample_time_s')!r} s stays{on} at every fixed parameter, "
        + ("at the samples and between them" if claim.get("between") else "at the samples"),
        "motion": f"the reference moves as the model does, each state by up to {claim.get('farthest')!r}",
    }[claim["kind"]].replace(" while the parameter's rate is at most None", "").replace(" while it is at most None", "")


def check_file(designs, path):
    """Whether every number that the record has of a design is the one of the design's file."""
    def same(mine, given):
        if isinstance(mine, dict):
            return isinstance(given, dict) and all(same(value, given.get(key)) for key, value in mine.items())
        if isinstance(mine, list):
            return isinstance(given, list) and len(mine) == len(given) and all(map(same, mine, given))
        return mine == given
    with open(path, encoding="utf-8") as text:
        file = json.load(text)
    if "model" not in file:
        added, files = ("design", "inner_of", "pieces", "joined"), [file, *file.get("inner", [])]
        mine = [{key: value for key, value in design.line.items() if key not in added} for design in designs]
        require(same(mine, files), "the file has another design")
        return
    for k, design in enumerate(designs):  # one polytope, or one for each vertex
        for key in ("sigma", "rate_vertices"):
            require(same(design.line.get(key), file.get(key)), "the file has another design")
        pairs = [(design.line["weights"], file.get("weights"))]
        pairs += [(design.line[key], file["model"][key]) for key in "AB"]
        pairs += [(design.line[key], file.get(key)) for key in "KFYL" if design.line.get(key) is not None]
        pairs += [([design.line["P"]], file["P"])] if design.common else []
        for mine, given in pairs:
            if isinstance(given, dict):
                mine, given = [mine["q"], mine["r"]], [given["Q"], given["R"]]
            each = given if given is None or isinstance(given[0][0], list) else [given]
            first = k if len(designs) > 1 else 0
            is_same = mine is each or all(same(x, each[(first + i) % len(each)]) for i, x in enumerate(mine))
            require(is_same, "the file has another design")

WORK = {}


def work(index):
    """Why a task is not proved, or nothing. (Balls are not sent between processes; they are inherited.)"""
    claim, group, floor = WORK["tasks"][index]
    design = WORK["designs"][claim["design"]]
    try:
        is_proved = prove_group(design, claim, group, floor) if group else all(
            is_definite(m.entries(), m.nrows()) for m in design.matrices(claim))
    except Exception as error:
        return f"claim {claim['claim']}: {error!r}"
    where = f" on piece {group['piece']}" if group else ""
    return "" if is_proved else f"claim {claim['claim']} ({statement(claim)}) is not proved{where}"


def check(path, file=None, jobs=2):
    """The claims of a record, all of which hold; else an exception says what does not."""
    lines, claims = read(path)
    designs, tasks = [Polytope(line) if "polytope" in line else Design(line) for line in lines], []
    if file is not None:
        check_file(designs, file)
    for claim in claims:
        design = designs[claim["design"]]
        if claim["kind"] == "motion":
            check_motion(designs, claims, claim)
            for number, bound in zip(claim["premises"], claim["bounds"]):
                premise = claims[claims[number]["premises"][0]]
                tasks += [(premise, group, bound["y"]) for group in premise["groups"]]
            continue
        check_premises(claims, claim, design)
        if isinstance(design, Design):
            check_cells(design, claim)
        tasks += [(claim, group, 0.0) for group in (claim["groups"] if isinstance(design, Design) else [None])]
    WORK.update(designs=designs, tasks=tasks)
    # the first cells of each claim before the second: what is false shows early
    order, rank = [], collections.Counter()
    for claim, _, floor in tasks:
        rank[claim["claim"], floor] += 1
        order.append(rank[claim["claim"], floor])
    order = sorted(range(len(tasks)), key=order.__getitem__)
    if jobs == 1:
        for failure in map(work, order):
            require(not failure, failure)
        return [statement(claim) for claim in claims]
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("fork")) as pool:
        for failure in pool.map(work, order, chunksize=4):
            if failure:
                pool.shutdown(cancel_futures=True)
                raise Refused(failure)
    return [statement(claim) for claim in claims]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("record")
    parser.add_argument("--design", help="file of the design that the record has to be about")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    try:
        statements = check(arguments.record, arguments.design, arguments.jobs)
    except Exception as error:  # whatever a record breaks, it is not proved
        print(f"refused: {error if isinstance(error, Refused) else repr(error)}")
        return 1
    print(*(f"holds: {text}" for text in statements), f"accepted: {len(statements)} claims", sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
