#!/usr/bin/env python3
"""Checks a proof record of lpv without lpv: `check.py RECORD [--design DESIGN.json] [--jobs N]`.

Everything is derived again from the numbers of the record: the plant's linearisation, the closed loop, the matrices that have to be
definite. Real numbers are balls of Arb (python-flint), whose radii hold every rounding. Nothing of lpv is imported, and its method is
not the one used here:

* Every matrix of a theorem is, on a piece of the parameter's range, a sum of constant matrices times t^j cos kρ and t^j sin kρ
  (`Sum`), ρ = low + ω (piece + t): gains are cubic splines in t, plant and Lyapunov matrix are trigonometric polynomials in ρ. Such
  sums are added, multiplied and differentiated as they are.
* On a cell [a, b], entry by entry, M(t) = chord of M(a), M(b) + e with e in [-(b - a)²/8, 0]·M''(cell) (interpolation error). If
  M(a) + e and M(b) + e are positive definite for every such e, so is every M(t), their convex combination.
* A symmetric ball matrix N is positive definite if T N Tᵀ is in Gershgorin's discs within 1 of I; T is any matrix, here of a
  Cholesky factorisation in floating point.

A cell that is too wide for that is halved; a cell that is missing is refused. Exit status 0 and `accepted` only if every claim holds.
"""
import argparse
import hashlib
import itertools
import json
import math
import multiprocessing
import sys
from fractions import Fraction
from operator import mul

from flint import arb, arb_mat, ctx

ctx.prec = 64  # bits
HALVINGS = 8  # of a cell
# A quotient of parameters is meant exactly or as the double nearest to it: both are in this ball around it.
ROUNDED = arb(1, 2.0**-50)
FORMAT = "lpv proof record 1"


class Refused(Exception):
    """The record does not prove what it says."""


def require(condition, why):
    if not condition:
        raise Refused(why)


# ---------------------------------------------------------------------------------------------------------------- the file


def no_twins(pairs):
    require(len({key for key, _ in pairs}) == len(pairs), "a key stands twice")
    return dict(pairs)


def no_decimals(text):
    raise Refused(f"{text} is no exact number")


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
    load = lambda text: json.loads(text, object_pairs_hook=no_twins, parse_float=no_decimals, parse_constant=no_decimals)
    head, lines = load(head), [exact(load(line)) for line in body.splitlines()]
    require(head["format"] == FORMAT and head["lines"] == len(lines), "lines are missing, or of another format")
    require(hashlib.sha256(body).hexdigest() == head["sha256"], "the digest is not that of the record")
    designs = [line for line in lines if "claim" not in line]
    claims = [line for line in lines if "claim" in line]
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
    """M ⪰ 0 (or ≻ 0), in rational numbers: every pivot of a symmetric elimination is, a zero one with zeros beside it."""
    m = [[Fraction(x) for x in row] for row in rows]
    for k in range(len(m)):
        if m[k][k] < 0 or (m[k][k] == 0 and (strictly or any(m[k][k + 1 :]))):
            return False
        for i in range(k + 1, len(m)):
            factor = m[i][k] / m[k][k] if m[k][k] else 0
            m[i] = [x - factor * y for x, y in zip(m[i], m[k])]
    return True


# ------------------------------------------------------------------------------------------ matrices as functions on a piece


class Sum:
    """Σ C t^j cos kρ (s = 0) or t^j sin kρ (s = 1): terms[j, k, s] = C, all of one shape."""

    def __init__(self, shape, terms):
        self.shape = shape
        vanishes = lambda key, c: key[1:] == (0, 1) or all(x.is_zero() for x in c.entries())
        self.terms = {key: c for key, c in terms.items() if not vanishes(key, c)}

    @staticmethod
    def constant(rows):
        return Sum((len(rows), len(rows[0])), {(0, 0, 0): arb_mat(rows)})

    def __add__(self, other):
        require(self.shape == other.shape, "matrices differ in size")
        terms = dict(self.terms)
        for key, c in other.terms.items():
            terms[key] = terms[key] + c if key in terms else c
        return Sum(self.shape, terms)

    def times(self, factor):
        return Sum(self.shape, {key: c * arb(factor) for key, c in self.terms.items()})

    def __sub__(self, other):
        return self + other.times(-1)

    def __matmul__(self, other):
        require(self.shape[1] == other.shape[0], "matrices differ in size")
        terms = {}
        for (i, k, s), left in self.terms.items():
            for (j, l, r), right in other.terms.items():
                # cos cos, sin sin, sin cos and cos sin of k and l, of k + l and k - l
                product, wave = left * right * arb(0.5), s ^ r
                for harmonic, sign in (k + l, -1 if s and r else 1), (k - l, -1 if r and not s else 1):
                    if wave and harmonic < 0:
                        sign = -sign
                    key = (i + j, abs(harmonic), wave)
                    piece = product * arb(sign)
                    terms[key] = terms[key] + piece if key in terms else piece
        return Sum((self.shape[0], other.shape[1]), terms)

    @property
    def t(self):
        return Sum(self.shape[::-1], {key: c.transpose() for key, c in self.terms.items()})

    def by_rho(self):
        """∂/∂ρ of one without t."""
        require(all(j == 0 for j, _, _ in self.terms), "only functions of ρ are differentiated")
        slope = lambda k, s: (arb(k), 0) if s else (arb(-k), 1)
        return Sum(self.shape, {(0, k, slope(k, s)[1]): c * slope(k, s)[0] for (_, k, s), c in self.terms.items()})

    def rows(self, picked):
        pick = lambda c: arb_mat([[c[i, j] for j in range(self.shape[1])] for i in picked])
        return Sum((len(picked), self.shape[1]), {key: pick(c) for key, c in self.terms.items()})

    def at(self, rho):
        """The value of one without t."""
        value = arb_mat(*self.shape)
        for (_, k, s), c in self.terms.items():
            value += c * (rho * k).sin_cos()[1 - s]
        return value

    def bound(self, i, j):
        """A bound on |entry| for all ρ: |c₀| + Σ √(cₖ² + sₖ²)."""
        waves = {k: [arb(0), arb(0)] for _, k, _ in self.terms}
        for (power, k, s), c in self.terms.items():
            require(power == 0, "only functions of ρ are bounded")
            waves[k][s] = c[i, j]
        return sum(((c.abs_upper() ** 2 + s.abs_upper() ** 2).sqrt().abs_upper() for c, s in waves.values()), arb(0))


def function(value, shape):
    """Σ fᵢ(ρ) Mᵢ as the record writes it."""
    total = Sum(shape, {})
    require(len(value["basis"]) == len(value["coefficients"]) > 0, "a function has too few coefficients")
    for basis, rows in zip(value["basis"], value["coefficients"]):
        require(basis["function"] in ("constant", "cos", "sin"), "only constants and harmonics are known")
        require((len(rows), len(rows[0])) == shape, "a coefficient is of another size")
        total += Sum(shape, {(0, basis.get("harmonic", 0), int(basis["function"] == "sin")): arb_mat(rows)})
    return total


def blocks(grid):
    """[[M₁₁, M₁₂, …], …] as one."""
    offsets = lambda sizes: list(itertools.accumulate(sizes, initial=0))
    down, across = offsets(row[0].shape[0] for row in grid), offsets(block.shape[1] for block in grid[0])
    shape, terms = (down[-1], across[-1]), {}
    for top, row in zip(down, grid):
        for left, block in zip(across, row):
            for key, c in block.terms.items():
                whole = terms.setdefault(key, arb_mat(*shape))
                for i, j in itertools.product(range(block.shape[0]), range(block.shape[1])):
                    whole[top + i, left + j] = c[i, j]
    return Sum(shape, terms)


# ------------------------------------------------------------------------------------------------------- positive definite


def inverse_factor(m, n):
    """L⁻¹ of M ≈ LLᵀ in floating point, as rows; None if there is none."""
    factor, inverse = [], []
    for i in range(n):
        row = []
        for j in range(i):
            row.append((m[i * n + j] - sum(map(mul, row, factor[j]))) / factor[j][j])
        pivot = m[i * n + i] - sum(map(mul, row, row))
        if not 0.0 < pivot < math.inf:
            return None
        pivot = math.sqrt(pivot)
        sums = [0.0] * n
        for x, known in zip(row, inverse):
            sums = [s - x * y for s, y in zip(sums, known)]
        sums[i] = 1.0
        inverse.append([s / pivot for s in sums])
        factor.append(row + [pivot])
    return inverse


def is_definite(entries, n):
    """Whether every symmetric matrix in the ball matrix is positive definite."""
    t = inverse_factor([float(entry.mid()) for entry in entries], n)
    if t is None or not all(math.isfinite(x) for row in t for x in row):
        return False
    t = arb_mat(t)
    near_one = (t * arb_mat(n, n, entries) * t.transpose()).entries()
    for i in range(n):
        near_one[i * n + i] -= 1
        if not sum((entry.abs_upper() for entry in near_one[i * n : i * n + n]), arb(0)) < 1:
            return False
    return True


class Family:
    """A symmetric matrix on a piece, enclosed at points and over cells; `slack` are rows δ that border it, see `falling`."""

    def __init__(self, place, base, slack=None):
        self.place, self.n, self.m = place, base.shape[0], slack.shape[0] if slack else 0
        sums = [base] + ([slack] if slack else [])
        self.keys = sorted(set().union(*(part.terms for part in sums)))
        entries = lambda part, key: part.terms[key].entries() if key in part.terms else [arb(0)] * mul(*part.shape)
        rows = [sum((entries(part, key) for part in sums), []) for key in self.keys]
        self.coefficients = arb_mat(rows) if rows else arb_mat(1, self.n * self.n)

    def scalars(self, t, second):
        """t^j cos kρ …, or their second derivatives, for t in a ball of the piece."""
        start, omega = self.place
        rho, waves, out = start + omega * t, {}, []
        for j, k, s in self.keys:
            if k not in waves:
                waves[k] = (rho * k).sin_cos()
            sine, cosine = waves[k]
            wave, slope = (sine, k * cosine) if s else (cosine, -k * sine)
            if not second:
                out.append(t**j * wave)
                continue
            value = -(k * omega) ** 2 * t**j * wave
            if j > 0:
                value += 2 * j * t ** (j - 1) * omega * slope
            if j > 1:
                value += j * (j - 1) * t ** (j - 2) * wave
            out.append(value)
        return out or [arb(0)]

    def over(self, rows):
        return (arb_mat(rows) * self.coefficients).tolist()

    def bordered(self, entries, c, corner):
        """[M, δᵀ; δ, 4 diag c] with δᵢ = gᵢ + cᵢdᵢ, from the entries of M, g and d."""
        if c is None:
            return entries
        n, m, half = self.n, self.m // 2, self.n + self.m // 2
        whole = [[arb(0)] * half for _ in range(half)]
        for i in range(n):
            whole[i][:n] = entries[i * n : i * n + n]
        for i in range(half - n):
            for j in range(n):
                g, d = entries[n * n + i * n + j], entries[n * n + (half - n + i) * n + j]
                whole[n + i][j] = whole[j][n + i] = g + c[i] * d
            whole[n + i][n + i] = corner * 4 * c[i]
        return sum(whole, [])

    def is_definite_on(self, cells, halvings=HALVINGS):
        """Whether it is on every cell [a, b, c] of t; cells follow each other."""
        ends = [arb(cells[0][0])] + [arb(b) for _, b, _ in cells]
        values = self.over([self.scalars(t, False) for t in ends])
        balls = [arb((arb(a) + b) / 2, ((arb(b) - a) / 2).abs_upper()) for a, b, _ in cells]
        bends = self.over([self.scalars(t, True) for t in balls])
        for (a, b, c), left, right, bend in zip(cells, values, values[1:], bends):
            # [-(b - a)²/8, 0]
            share = arb(-1, 1) * ((arb(b) - a) ** 2 / 16)
            size, error = self.n + self.m // 2, self.bordered([share * x for x in bend], c, 0)
            add = lambda value: [x + e for x, e in zip(self.bordered(value, c, 1), error)]
            if not (is_definite(add(left), size) and is_definite(add(right), size)):
                middle = a + (b - a) / 2
                if halvings == 0 or not a < middle < b:
                    return False
                if not self.is_definite_on([[a, middle, c], [middle, b, c]], halvings - 1):
                    return False
        return True


# ------------------------------------------------------------------------------------------------------------- the designs


def plant_of(plant):
    """A(ρ) = ∂f/∂x and B(ρ) = ∂f/∂u at rest, u*, and where ρ is in x; derived by hand from ẋ = f(x, u)."""
    one = lambda rows, columns, entries, key=(0, 0, 0): Sum(
        (rows, columns),
        {key: arb_mat([[entries.get((i, j), arb(0)) for j in range(columns)] for i in range(rows)])},
    )
    if plant["name"] == "quadrotor":
        # v̇ = (sin θ, -sin φ cos θ, cos φ cos θ) ΣF/m - (0, 0, g), ṙ = v,
        # ṗ = (F₂ - F₄)ℓ/I_x - …qr, q̇ = (F₃ - F₁)ℓ/I_y - …pr, ṙ = (F₁ - F₂ + F₃ - F₄)d/I_z - …pq,
        # φ̇ = (p cos ψ - q sin ψ)/cos θ, θ̇ = p sin ψ + q cos ψ, ψ̇ = r - (p cos ψ - q sin ψ) tan θ; at rest F = mg/4
        keys = "mass_kg gravity_m_s2 inertia_x_kg_m2 inertia_y_kg_m2 inertia_z_kg_m2 arm_length_m drag_to_lift_m".split()
        require(all(plant[key] > 0 for key in keys), "a parameter of the quadrotor is not positive")
        mass, g, ix, iy, iz, arm, drag = (arb(plant[key]) for key in keys)
        g, by_mass, p, q, r = (ROUNDED * x for x in (g, 1 / mass, arm / ix, arm / iy, drag / iz))
        a = {(3, 0): arb(1), (4, 1): arb(1), (5, 2): arb(1), (11, 8): arb(1), (0, 10): g, (1, 9): -g}
        b = {(2, i): by_mass for i in range(4)}
        b |= {(6, 1): p, (6, 3): -p, (7, 2): q, (7, 0): -q, (8, 0): r, (8, 1): -r, (8, 2): r, (8, 3): -r}
        turning = one(12, 12, {(9, 6): arb(1), (10, 7): arb(1)}, (0, 1, 0)) + one(
            12, 12, {(9, 7): arb(-1), (10, 6): arb(1)}, (0, 1, 1)
        )
        hover = plant["mass_kg"] * plant["gravity_m_s2"] / 4
        return one(12, 12, a) + turning, one(12, 4, b), [hover] * 4, 11
    if plant["name"] == "linear":
        return Sum.constant(plant["A"]), Sum.constant(plant["B"]), [0.0] * len(plant["B"][0]), None
    # ẋ₁ = x₂, ẋ₂ = u; of the pendulum ẋ₂ = -0.1 x₂ + sin x₁ + u
    require(plant["name"] in ("pendulum", "double-integrator"), "the plant is not known")
    row = [1.0, -0.1] if plant["name"] == "pendulum" else [0.0, 0.0]
    return Sum.constant([[0.0, 1.0], row]), Sum.constant([[0.0], [1.0]]), [0.0], None


class Design:
    """The closed loop of a plant and a design, and V = xᵀPx or xᵀY⁻¹x."""

    def __init__(self, line):
        self.line, controller = line, line["controller"]
        self.a, self.b, trim, self.parameter = plant_of(line["plant"])
        self.n, self.m = self.b.shape
        require(controller["operating_input"] == trim, "the operating input is not that of the plant")
        require(controller["scheduling_state"] == self.parameter, "the scheduling state is not that of the plant")
        self.q, self.r = line["weights"]["q"], line["weights"]["r"]
        symmetric(self.q, self.n, "Q"), symmetric(self.r, self.m, "R")
        require(semidefinite(self.q, False) and semidefinite(self.r, True), "Q is not semidefinite, or R not definite")
        self.sigma = [self.room(controller["limits"], i) for i in range(self.m)]
        require(all(sigma is None or sigma > 0 for sigma in self.sigma), "an input has no room")
        # ρ = -π + ω t, t from 0 to the number of pieces, once around the circle
        self.pieces, self.points = line["pieces"], line["points"]
        require(0 < self.pieces <= 4096 and (self.parameter is not None or self.pieces == 1), "the pieces are wrong")
        self.low = arb(-math.pi) if self.parameter is not None else arb(0)
        self.omega = 2 * arb.pi() / self.pieces if self.parameter is not None else arb(0)
        self.gain = controller["schedule"]
        self.check_schedule()
        moving = line.get("rate_bounded")
        has_auxiliary = all(point["auxiliary_gain"] is not None for point in self.points)
        require(has_auxiliary or all(point["auxiliary_gain"] is None for point in self.points), "some F are missing")
        given = lambda value, rows: function(value, (rows, self.n)) if has_auxiliary else None
        self.inverse = moving is not None
        if moving:
            matrices = moving["y"]["coefficients"]
            self.lyapunov, self.low_gain = function(moving["y"], (self.n, self.n)), given(moving["l"], self.m)
        elif self.parameter is not None:
            matrices = line["joined"]["p"]["coefficients"]
            self.lyapunov = function(line["joined"]["p"], (self.n, self.n))
            self.low_gain = given(line["joined"]["auxiliary"], self.m)
        else:
            require(len(self.points) == 1, "a plant without a parameter has one point")
            matrices, self.lyapunov = [self.points[0]["p"]], Sum.constant(self.points[0]["p"])
            self.low_gain = Sum.constant(self.points[0]["auxiliary_gain"]) if has_auxiliary else None
        for k, rows in enumerate(matrices):
            symmetric(rows, self.n, f"matrix {k} of the Lyapunov function")
        self.check_points()

    def room(self, limits, i):
        """σᵢ: |uᵢ - u*ᵢ| ≤ σᵢ is within the limits; None where there are none."""
        trim = Fraction(self.line["controller"]["operating_input"][i])
        least, most = limits["min"][i], limits["max"][i]
        sides = [trim - Fraction(least)] if least is not None else []
        sides += [Fraction(most) - trim] if most is not None else []
        return min(sides) if sides else None

    def check_schedule(self):
        """Knots are where they should be, and gains at knots those of the points."""
        schedule, gains = self.gain, [point["gain"] for point in self.points]
        for k, point in enumerate(self.points if self.parameter is not None else []):
            off = arb(point["rho"]) - (self.low + 2 * arb.pi() * k / len(self.points))
            require(off.abs_upper() < 1e-12, "a grid point is not where it should be")
        require(all((len(k), len(k[0])) == (self.m, self.n) for k in gains), "a gain is of another size")
        if schedule["kind"] == "grid":
            require(self.parameter is not None and len(gains) == self.pieces > 3, "the knots are wrong")
            require(abs(schedule["period"] - 2 * math.pi) < 1e-12, "the gains are not periodic")
            require(schedule["parameters"] == [point["rho"] for point in self.points], "knots differ from grid points")
            require(schedule["gains"] == gains, "scheduled gains differ from those of the grid points")
        elif schedule["kind"] == "constant":
            require(len(gains) == 1 and schedule["gain"] == gains[0], "the gain differs from that of the point")
        else:
            require(schedule["kind"] == "vertices" and self.parameter is not None, "the schedule is not known")
            weights = schedule["weights"]
            corners = list(itertools.product((-1.0, 1.0), repeat=len(weights["features"])))
            require(sorted(map(tuple, weights["corners"])) == corners, "the corners are not those of a box")
            for point in self.points:
                off = self.schedule(0).at(arb(point["rho"])) - arb_mat(point["gain"])
                largest = max(abs(x) for row in point["gain"] for x in row)
                require(all(x.abs_upper() < 1e-3 * largest for x in off.entries()), "the gain is far from the points'")

    def check_points(self):
        """P (and F) of the points is that of the function up to rounding, the same data twice: P Y = I, or the harmonics of P."""
        for point in self.points:
            symmetric(point["p"], self.n, "P of a point")
            if self.inverse:
                off = self.lyapunov.at(arb(point["rho"])) * arb_mat(point["p"])
                unit = all((off[i, j] - int(i == j)).abs_upper() < 1e-6 for i in range(self.n) for j in range(self.n))
                require(unit, "P of a point is not the inverse of Y")
        pairs = [(self.lyapunov, "p")] + ([(self.low_gain, "auxiliary_gain")] if self.low_gain is not None else [])
        for total, key in pairs if self.parameter is not None and not self.inverse else []:
            given, count = [arb_mat(point[key]) for point in self.points], len(self.points)
            size = max(x.abs_upper() for rows in given for x in rows.entries())
            for k, s in itertools.product(range((count - 1) // 2 + 1), (0, 1)):
                waves = [(arb(point["rho"]) * k).sin_cos()[1 - s] for point in self.points]
                fitted = sum((p * w for p, w in zip(given, waves)), arb_mat(*total.shape)) * (arb(2 if k else 1) / count)
                off = fitted - total.terms.get((0, k, s), arb_mat(*total.shape))
                require(all(x.abs_upper() < 1e-10 * size for x in off.entries()), f"harmonic {k} is not that of the points")

    def schedule(self, piece):
        """K on a piece: the cubic in t through the knots before, at both ends and after it; or Σ wᵢ(ρ)Kᵢ."""
        shape, schedule = (self.m, self.n), self.gain
        if schedule["kind"] == "constant":
            return Sum.constant(schedule["gain"])
        if schedule["kind"] == "vertices":
            total = Sum(shape, {})
            for corner, gain in zip(schedule["weights"]["corners"], schedule["gains"], strict=True):
                weight = Sum.constant([[1.0]])
                for c, feature in zip(corner, schedule["weights"]["features"], strict=True):
                    wave = {"cos": 0, "sin": 1}[feature]
                    weight @= Sum((1, 1), {(0, 0, 0): arb_mat([[0.5]]), (0, 1, wave): arb_mat([[c / 2]])})
                total += Sum(shape, {key: arb_mat(gain) * w[0, 0] for key, w in weight.terms.items()})
            return total
        total, nodes = Sum(shape, {}), (-1, 0, 1, 2)
        for node in nodes:
            weight = [Fraction(1)]  # Π (t - other)/(node - other), by powers of t
            for other in nodes:
                if other != node:
                    down, up = [x * -other for x in weight] + [0], [0] + weight
                    weight = [Fraction(x + y, node - other) for x, y in zip(down, up)]
            gain = arb_mat(schedule["gains"][(piece + node) % self.pieces])
            total += Sum(shape, {(j, 0, 0): gain * ball(w) for j, w in enumerate(weight)})
        return total

    def place(self, piece):
        return self.low + self.omega * piece, self.omega

    def saturating(self):
        """Inputs that lie between rows of F and K on the set."""
        return [i for i in range(self.m) if self.low_gain is not None and self.sigma[i] is not None]

    def gains(self, piece):
        """K, and the rows that are not to saturate; both times Y in the inverse form."""
        k = self.schedule(piece)
        k = k @ self.lyapunov if self.inverse else k
        low = [(self.low_gain if i in self.saturating() else k).rows([i]) for i in range(self.m)]
        return k, blocks([[row] for row in low])

    def limited(self):
        """Inputs that could reach a limit."""
        low = [self.gains(piece)[1] for piece in range(self.pieces)]
        return [i for i in range(self.m) if self.sigma[i] is not None and any(k.rows([i]).terms for k in low)]

    def definite(self, piece, floor=0.0):
        """Y ⪰ floor I, or P ⪯ I/floor; with 0 that it is positive definite."""
        unit = lambda x: Sum.constant([[x if i == j else 0.0 for j in range(self.n)] for i in range(self.n)])
        if floor == 0.0 or self.inverse:
            return Family(self.place(piece), self.lyapunov - unit(floor))
        return Family(self.place(piece), unit(1.0) - self.lyapunov.times(floor))

    def unsaturated(self, piece, i, level):
        """[σ²/γ, f; fᵀ, P] ≻ 0, or the same with fY and Y: (fx)² < σ² where V ≤ γ."""
        row = self.gains(piece)[1].rows([i])
        corner = Sum((1, 1), {(0, 0, 0): arb_mat([[ball(self.sigma[i] ** 2) / arb(level)]])})
        return Family(self.place(piece), blocks([[corner, row], [row.t, self.lyapunov]]))

    def falling(self, piece, flying, rate, factor, share):
        """-V̇ - (share/factor)(xᵀQx + uᵀRu) > 0 for the input rows of K that are `flying`, the others being of F.

        V = xᵀPx:     -(P(A - BS) + ·ᵀ + ρ̇ P′) - (share/factor)(Q + SᵀRS)
        V = xᵀY⁻¹x:   -(AY - BG + ·ᵀ) + ρ̇ Y′ - (share/factor)(YQY + GᵀRG),  G = SY, between Y⁻¹

        With flying = "rows" an input is f x + θ(k - f)x, 0 ≤ θ ≤ 1, and θ² ≤ θ: what S = F leaves is at least that less θ Σ (dᵢx)(gᵢx),
        d = k - f, g = (share/factor) rᵢ(k + f) - 2bᵢᵀP; and (dx)(gx) ≤ ((g + cd)x)²/4c for c > 0 (its Schur complement borders).
        """
        w, q, r = self.lyapunov, Sum.constant(self.q), Sum.constant(self.r)
        k, low = self.gains(piece)
        saturating, ratio = self.saturating(), arb(share) / arb(factor)
        if saturating:
            flies = lambda i: i not in saturating or (flying != "rows" and i in flying)
            s = blocks([[(k if flies(i) else low).rows([i])] for i in range(self.m)])
        else:
            s = k
        if self.inverse:
            flow, stage, motion = self.b @ s - self.a @ w, w @ q @ w + s.t @ r @ s, w.by_rho()
        else:
            flow, stage, motion = w @ (self.b @ s - self.a), q + s.t @ r @ s, w.by_rho().times(-1)
        base, slack = flow + flow.t + motion.times(rate) - stage.times(ratio), None
        if saturating and flying == "rows":
            require(all(self.r[i][j] == 0 for i in range(self.m) for j in range(i)), "R is not diagonal")
            pb = self.b if self.inverse else w @ self.b
            push = (r @ (k + low)).times(ratio) - pb.t.times(2)
            slack = blocks([[push.rows(saturating)], [(k - low).rows(saturating)]])
        return Family(self.place(piece), base, slack)

    def increment(self, piece, sample_time_s):
        """E with x₊ = (I + TE)x for an input held for T: E = Φ(A - BK), Φ = Σ (AT)^k/(k + 1)!."""
        at, power = self.a.times(sample_time_s), Sum.constant([[float(i == j) for j in range(self.n)] for i in range(self.n)])
        series, k, terms = power, 0, 24
        while power.terms and k < terms:
            k += 1
            power = (power @ at).times(arb(1) / (k + 1))
            series += power
        if power.terms:
            # ‖rest‖ ≤ Σ_{k > N} a^k/(k + 1)! ≤ 2 a^(N+1)/(N + 2)! for the row-sum norm a ≤ N/2 of AT
            require(set(at.terms) == {(0, 0, 0)}, "the series of a plant with a parameter does not end")
            rows = at.terms[0, 0, 0].tolist()
            norm = max((sum((x.abs_upper() for x in row), arb(0)) for row in rows), key=float).abs_upper()
            require(norm < terms / 2, "the sample time is too long")
            rest = arb(0, 2 * norm ** (terms + 1) / arb.fac_ui(terms + 2))
            series += Sum((self.n, self.n), {(0, 0, 0): arb_mat([[rest] * self.n] * self.n)})
        return series @ (self.a - self.b @ self.schedule(piece))


def ball(fraction):
    return arb(fraction.numerator) / arb(fraction.denominator)


# --------------------------------------------------------------------------------------------------------------- the claims


class Polytope:
    """A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ; V = xᵀPx, u = -Σ ρᵢKᵢx, or V = xᵀ(Σ ρᵢYᵢ)⁻¹x, u = -(Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹x."""

    def __init__(self, line):
        self.line, self.common = line, "P" in line
        self.a, self.b = ([arb_mat(rows) for rows in line[key]] for key in "AB")
        self.count, self.n, self.m = len(self.a), self.a[0].nrows(), self.b[0].ncols()
        given = [line["P"]] * self.count if self.common else line["Y"]
        gains = line["K" if self.common else "L"]
        sizes = [(self.a, self.n, self.n), (self.b, self.n, self.m), (list(map(arb_mat, gains)), self.m, self.n)]
        for matrices, rows, columns in sizes:
            require(len(matrices) == self.count, "a vertex is missing")
            require(all((x.nrows(), x.ncols()) == (rows, columns) for x in matrices), "a matrix is of another size")
        for rows in given:
            symmetric(rows, self.n, "P or Y")
        self.lyapunov, self.gain = list(map(arb_mat, given)), sizes[2][0]
        self.sigma = line["sigma"] or [None] * self.m
        require(len(self.sigma) == self.m and all(s is None or s > 0 for s in self.sigma), "sigma is wrong")
        self.rates = [[0.0] * self.count] if self.common else line["rate_vertices"]
        require(self.rates and all(len(rates) == self.count for rates in self.rates), "rate vertices are wrong")
        low = self.gain if line["F"] is None else [arb_mat(f) for f in line["F"]]
        if line["F"] is not None and not self.common:
            low = [f * y for f, y in zip(low, self.lyapunov)]
        require(len(low) == self.count, "an F is missing")
        self.saturating = [i for i in range(self.m) if line["F"] is not None and self.sigma[i] is not None]
        self.low = [self.mixed(i, low, [j for j in range(self.m) if j not in self.saturating]) for i in range(self.count)]
        if line["weights"]:
            self.q, self.r = line["weights"]["q"], line["weights"]["r"]
            symmetric(self.q, self.n, "Q"), symmetric(self.r, self.m, "R")
            require(semidefinite(self.q, False) and semidefinite(self.r, True), "Q or R is not definite")
            self.q, self.r = arb_mat(self.q), arb_mat(self.r)

    def mixed(self, i, low, flying):
        rows = [(self.gain if k in flying else low)[i].tolist()[k] for k in range(self.m)]
        return arb_mat(rows)

    def limited(self):
        moves = lambda i: any(not x.is_zero() for k in self.low for x in k.tolist()[i])
        return [i for i in range(self.m) if self.sigma[i] is not None and moves(i)]

    def matrices(self, claim):
        """All that have to be definite: Σ ρᵢρⱼ Mᵢⱼ ≻ 0 if every Mᵢᵢ ≻ 0 and Mᵢⱼ + Mⱼᵢ ≻ 0."""
        if claim["kind"] == "definite":
            yield from self.lyapunov
        elif claim["kind"] == "unsaturated":
            for i, vertex in itertools.product(self.limited(), range(self.count)):
                row = self.low[vertex].tolist()[i]
                corner = ball(Fraction(self.sigma[i]) ** 2) / arb(claim["level"])
                yield arb_mat([[corner] + row] + [[x] + y for x, y in zip(row, self.lyapunov[vertex].tolist())])
        else:
            pairs = list(itertools.combinations_with_replacement(range(self.count), 2))
            for size in range(len(self.saturating) + 1):
                for flying in itertools.combinations(self.saturating, size):
                    others = [i for i in range(self.m) if i not in self.saturating]
                    s = [self.mixed(i, self.low, [*flying, *others]) for i in range(self.count)]
                    for rates, (i, j) in itertools.product(self.rates, pairs):
                        m = self.pair(i, j, s, rates, claim)
                        yield m if i == j else m + self.pair(j, i, s, rates, claim)

    def pair(self, i, j, s, rates, claim):
        """Mᵢⱼ of -V̇ - (xᵀQx + uᵀRu)/factor."""
        w = self.lyapunov
        flow = w[0] * (self.b[i] * s[j] - self.a[i]) if self.common else self.b[i] * s[j] - self.a[i] * w[j]
        m = flow + flow.transpose()
        for rate, y in zip(rates, w):
            m += y * arb(rate)
        if claim["kind"] == "cost":
            stage = s[i].transpose() * self.r * s[j] + (self.q if self.common else w[i] * self.q * w[j])
            m -= (stage + stage.transpose()) / (2 * arb(claim["factor"]))
        return m


def premises_hold(claims, claim, design):
    """Whether a claim rests on earlier claims of the right kind, about the same design, level and rate."""
    kind, premises = claim["kind"], [claims[number] for number in claim["premises"]]
    twins = [other for other in claims if (other["design"], other["kind"]) == (claim["design"], kind)]
    require(len(twins) == 1, f"there are {len(twins)} claims of this kind")
    limited = kind not in ("definite", "sampled") and bool(design.limited())
    between = ["unsaturated"] if limited else []
    needed = {"definite": [], "sampled": [], "unsaturated": ["definite"], "decrease": ["definite", *between]}
    needed["cost"] = needed["decrease"] + ["decrease"]
    require(kind in needed, f"{kind} is not known")
    require([premise["kind"] for premise in premises] == needed[kind], "it does not rest on what it has to")
    require(all(premise["design"] == claim["design"] for premise in premises), "a premise is of another design")
    require(kind in ("definite", "sampled") or (claim["level"] is None) != limited, "it needs a level, or none")
    require(not limited or claim["level"] > 0, "the level is not positive")
    for premise in premises[1:]:
        require(premise["level"] == claim["level"], "a premise is about another level")
    require(kind != "cost" or claim["factor"] >= 1, "the factor is below one")
    if kind in ("decrease", "cost") and isinstance(design, Design):
        require(claim["rate"] >= 0 and (kind != "cost" or premises[-1]["rate"] >= claim["rate"]), "the rate is wrong")
    require(kind != "sampled" or claim["sample_time_s"] == design.line["sample_time_s"] > 0, "the sample time is wrong")


def check_cells(design, claim):
    """Whether the cells of every variant cover the range without gaps."""
    groups = claim["groups"]
    variants = [None]
    if claim["kind"] == "unsaturated":
        variants = design.limited()
    if claim["kind"] in ("decrease", "cost") and design.saturating() and groups[0]["variant"] != "rows":
        subsets = itertools.product((False, True), repeat=design.m)
        variants = [[i for i, flies in enumerate(subset) if flies] for subset in subsets]
    elif claim["kind"] in ("decrease", "cost") and design.saturating():
        variants = ["rows"]
    order = lambda key: (key[0], str(key[1]))
    found = sorted(((group["piece"], group["variant"]) for group in groups), key=order)
    require(found == sorted(itertools.product(range(design.pieces), variants), key=order), "cells are missing")
    for group in groups:
        cells, piece = group["cells"], group["piece"]
        require(cells and cells[0][0] == piece and cells[-1][1] == piece + 1, "cells do not cover their piece")
        require(all(cell[0] < cell[1] for cell in cells), "a cell is empty")
        require(all(left[1] == right[0] for left, right in zip(cells, cells[1:])), "there is a gap between cells")


def prove_group(design, claim, group):
    """Whether a claim holds on the cells of a group."""
    kind, piece, variant = claim["kind"], group["piece"], group["variant"]
    cells = [[cell[0] - piece, cell[1] - piece, cell[2] if len(cell) > 2 else None] for cell in group["cells"]]
    require(all(len(cell) == (3 if kind == "sampled" or variant == "rows" else 2) for cell in group["cells"]), "a cell is odd")
    if kind == "sampled":
        return prove_sampled(design, piece, cells, claim["sample_time_s"])
    if kind == "definite":
        families = [design.definite(piece, claim.get("floor", 0.0))]
    elif kind == "unsaturated":
        families = [design.unsaturated(piece, variant, claim["level"])]
    else:
        rates = [-claim["rate"], claim["rate"]] if claim["rate"] > 0 and design.parameter is not None else [0.0]
        factor, share = (claim["factor"], 1) if kind == "cost" else (1, 0)
        families = [design.falling(piece, variant, rate, factor, share) for rate in rates]
    if variant == "rows":
        many = len(design.saturating())
        require(all(len(c) == many and min(c) > 0 for _, _, c in cells), "a weight of a row is not positive")
        cells = [[a, b, list(map(arb, c))] for a, b, c in cells]
    return all(family.is_definite_on(cells) for family in families)


def prove_sampled(design, piece, cells, sample_time_s):
    """With X of the cell: [-(EᵀX + XE), TEᵀX; TXE, TX] ≻ 0, so that X - (I + TE)ᵀX(I + TE) ≻ 0 and X ≻ 0."""
    e, n, time = design.increment(piece, sample_time_s), design.n, arb(sample_time_s)
    family = Family(design.place(piece), e)

    def bordered(entries, c, corner):
        xe = c * arb_mat(n, n, entries)
        flow = (xe + xe.transpose()).tolist()
        side, x = (xe * time).tolist(), (c * (time * corner)).tolist()
        top = [[-flow[i][j] for j in range(n)] + [side[j][i] for j in range(n)] for i in range(n)]
        return sum(top + [side[i] + x[i] for i in range(n)], [])

    family.bordered, family.m = bordered, 2 * n
    for cell in cells:
        symmetric(cell[2], n, "X")
        if not family.is_definite_on([[cell[0], cell[1], arb_mat(cell[2])]]):
            return False
    return True


def check_motion(designs, claims, claim):
    """Whether the reference of a governor moves as the model does, but for a disturbance that the sets absorb.

    x_ref = x₀ + Σ s⁽ᵏ⁾ Z_kΔ and u_ref = Σ s⁽ᵏ⁾ (U_k + ρ̇V_k)Δ leave w = Σ s⁽ᵏ⁺¹⁾ R_kΔ + ρ̇ Σ s⁽ᵏ⁾ S_kΔ,
    R_k = Z_k - AZ_{k+1} - BU_{k+1}, S_k = Z_k′ - BV_k. On V = γ: |2eᵀPw| ≤ 2√γ|w|/√y for Y ⪰ yI, and eᵀQe ≥ q|e|² ≥ qyγ for Q ⪰ qI,
    so that |w| < q y^{3/2} √γ/(2 factor) leaves {V ≤ γ} invariant.
    """
    outer, d = designs[claim["design"]], claim["design"]
    members = [d] + [k for k, line in enumerate(designs) if line.line.get("inner_of") == d]
    supervisor = outer.line["controller"]["supervisor"]
    governor = supervisor["governor"]
    motion, states = governor["motion"], governor["set_point_states"]
    premises = [claims[number] for number in claim["premises"]]
    require([p["kind"] for p in premises] == ["cost"] * len(members), "it does not rest on the costs of all members")
    require([p["design"] for p in premises] == members and len(claim["bounds"]) == len(members), "a member is missing")
    inner = [designs[k].line["controller"]["schedule"] for k in members[1:]]
    require([member["schedule"] for member in supervisor["inner"]] == inner, "inner gains differ from those that fly")
    require(len(set(states)) == len(states) and set(states) <= set(range(outer.n)), "the set-point states are wrong")
    rate, most = motion["parameter_rate"], lambda bounds, i: bounds[i] if bounds[i] is not None else math.inf
    for number in members:
        design = designs[number]
        require(design.line["plant"] == outer.line["plant"], "a member is of another plant")
        require(design.line["weights"] == outer.line["weights"], "a member has other weights")
        for i, budget in enumerate(motion["input_budget"]):
            all_of_it = design.room(motion["actuators"], i)
            require(budget >= 0 and Fraction(budget) + design.sigma[i] <= all_of_it, "inputs exceed the actuators")
    require(all(0 <= premise["rate"] <= rate for premise in premises), "a member moves faster than the reference allows for")
    require(outer.parameter is not None or rate == 0, "there is no parameter that could move")
    shape = lambda rows: (rows, len(states))
    z = [Sum.constant([[float(i == j) for j in states] for i in range(outer.n)])]
    require(not (outer.a @ z[0]).terms, "the plant does not rest wherever it is put")
    z += [function(value, shape(outer.n)) for value in motion["states"]] + [Sum(shape(outer.n), {})]
    u = [function(value, shape(outer.m)) for value in motion["inputs"]]
    v = [function(value, shape(outer.m)) for value in motion["inputs_by_rate"]] or [Sum(shape(outer.m), {})] * (len(u) - 1)
    require(len(z) == len(u) + 1 and len(v) == len(u) - 1, "the chain of the motion is broken")
    if outer.parameter is not None:
        off = function(motion["parameter_flow"], (1, outer.n)) - outer.a.rows([outer.parameter])
        require(all(off.bound(0, j) < 1e-12 for j in range(outer.n)), "the model's parameter moves otherwise")
    along = [z[k] - outer.a @ z[k + 1] - outer.b @ u[k] for k in range(len(u))]
    across = [z[k + 1].by_rho() - outer.b @ v[k] for k in range(len(v))]
    worst = arb(0)
    for j, state in enumerate(states):
        move = arb.pi() if state == outer.parameter else arb(claim["farthest"])
        # |s⁽ᵏ⁾| ≤ bₖ from the bounds on inputs and states, and so pₖ ≤ b_m^{k/m} for every m ≥ k (see the profile of the reference)
        bounds = [[] for _ in u]
        if state == outer.parameter and governor["parameter_rate"] is not None:
            bounds[0].append(arb(governor["parameter_rate"]) / move)
        for k, bound in enumerate(bounds):
            for i in range(outer.m):
                used = u[k].bound(i, j) + (rate * v[k].bound(i, j) if k < len(v) else 0)
                if used > 0:
                    bound.append(arb(motion["input_budget"][i]) / (used * move))
            for i in range(outer.n):
                if most(motion["state_bounds"], i) < math.inf and z[k + 1].bound(i, j) > 0:
                    bound.append(arb(motion["state_bounds"][i]) / (z[k + 1].bound(i, j) * move))
        least = [min(bound) if bound else None for bound in bounds]
        peak = lambda k: min(least[m] ** (arb(k + 1) / (m + 1)) for m in range(k, len(u)) if least[m] is not None)
        # a derivative that nothing bounds has to move nothing
        times = lambda k, size: peak(k) * size if size > 0 else size
        total = arb(0)
        for i in range(outer.n):
            row = sum((times(k, along[k].bound(i, j)) for k in range(len(u))), arb(0))
            row += sum((rate * times(k, across[k].bound(i, j)) for k in range(len(across))), arb(0))
            total += (row * move) ** 2
        worst = worst.max(total.abs_upper().sqrt())
    for premise, bound in zip(premises, claim["bounds"]):
        q, y = bound["q"], bound["y"]
        shifted = [[Fraction(x) - (Fraction(q) if i == k else 0) for k, x in enumerate(row)] for i, row in enumerate(outer.q)]
        require(q > 0 and y > 0 and semidefinite(shifted, False), "Q is not above its bound")
        absorbed = arb(q) * arb(y) ** arb(1.5) * arb(premise["level"]).sqrt() / (2 * arb(premise["factor"]))
        require(worst < absorbed, f"the sets do not absorb {worst}, but {absorbed}")


def statement(claim, design):
    """The claim in words, from its own numbers."""
    on = f" on V <= {claim['level']!r}" if claim.get("level") is not None else ""
    moving = ""
    if isinstance(design, Design) and design.parameter is not None and "rate" in claim:
        moving = f" for |rate| <= {claim['rate']!r}"
    return {
        "definite": lambda: "the Lyapunov matrix is positive definite",
        "unsaturated": lambda: f"the low gain does not saturate{on}",
        "decrease": lambda: f"V decreases{on}{moving}" + (", so that this set is invariant" if on else ""),
        "cost": lambda: f"the cost is at most {claim['factor']!r} V(x(0)){on}{moving}",
        "sampled": lambda: f"the loop sampled at T = {claim['sample_time_s']!r} s is stable at every fixed parameter",
        "motion": lambda: f"the reference moves as the model does, up to {claim['farthest']!r} along each state",
    }[claim["kind"]]()


def same(record, file):
    """Whether what the record has of a design is what the design's file has."""
    if isinstance(record, dict):
        return isinstance(file, dict) and all(same(value, file.get(key)) for key, value in record.items())
    if isinstance(record, list):
        return isinstance(file, list) and len(record) == len(file) and all(map(same, record, file))
    return record == file


def check_file(designs, path):
    """Whether the record is about this file's design."""
    with open(path, encoding="utf-8") as text:
        file = json.load(text)
    if isinstance(designs[0], Design):
        added = ("design", "inner_of", "pieces", "joined")
        files = [file, *file.get("inner", [])]
        require(len(files) == len(designs), "the file has other members")
        for design, one in zip(designs, files):
            require(same({k: v for k, v in design.line.items() if k not in added}, one), "the file has another design")
        return
    for design in designs if len(designs) == 1 else []:
        line, each = design.line, lambda value: value if isinstance(value[0][0], list) else [value]
        pairs = [(line["A"], file["model"]["A"]), (line["B"], file["model"]["B"])]
        pairs += [(line[key], file[key]) for key in "KFYL" if line.get(key) is not None]
        pairs += [([line["P"]], file["P"])] if design.common else []
        for mine, given in pairs:
            given = each(given)
            require(all(same(matrix, given[i % len(given)]) for i, matrix in enumerate(mine)), "the file has another design")


WORK = {}


def work(task):
    """One task of a claim; an empty string if it is proved. (Balls are not sent between processes.)"""
    designs, tasks = WORK["designs"], WORK["tasks"]
    claim, group = tasks[task]
    design = designs[claim["design"]]
    try:
        if group is None:
            done = all(is_definite(m.entries(), m.nrows()) for m in design.matrices(claim))
        else:
            done = prove_group(design, claim, group)
    except (Refused, KeyError, IndexError, TypeError, ValueError, ZeroDivisionError) as error:
        return f"claim {claim['claim']}: {error}"
    where = f" on piece {group['piece']}" if group else ""
    return "" if done else f"claim {claim['claim']}: {statement(claim, design)}: not proved{where}"


def check(path, file=None, jobs=2):
    """The statements of a record that holds.

    Raises [Refused] with the reason if it does not.
    """
    designs, claims = read(path)
    designs = [Polytope(line) if "polytope" in line else Design(line) for line in designs]
    if file is not None:
        check_file(designs, file)
    tasks = []
    for claim in claims:
        design = designs[claim["design"]]
        if claim["kind"] == "motion":
            check_motion(designs, claims, claim)
            for number, bound in zip(claim["premises"], claim["bounds"]):
                definite = claims[claims[number]["premises"][0]]
                tasks += [({**definite, "floor": bound["y"], "claim": claim["claim"]}, g) for g in definite["groups"]]
            continue
        premises_hold(claims, claim, design)
        if isinstance(design, Polytope):
            tasks.append((claim, None))
        else:
            check_cells(design, claim)
            tasks += [(claim, group) for group in claim["groups"]]
    WORK.update(designs=designs, tasks=tasks)
    with multiprocessing.get_context("fork").Pool(jobs) as pool:
        for failure in pool.imap_unordered(work, range(len(tasks)), 4):
            require(not failure, failure)
    return [statement(claim, designs[claim["design"]]) for claim in claims]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("record")
    parser.add_argument("--design", help="file of the design that the record has to be about")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    try:
        statements = check(arguments.record, arguments.design, arguments.jobs)
    except (Refused, KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError) as error:
        print(f"refused: {error if isinstance(error, Refused) else repr(error)}")
        return 1
    for text in statements:
        print(f"holds: {text}")
    print(f"accepted: {len(statements)} claims")
    return 0


if __name__ == "__main__":
    sys.exit(main())
