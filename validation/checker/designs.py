"""Designs and polytopes of a record: the plant's linearisation, the closed loop, and the matrices of each theorem."""
import functools
import itertools
import math
from fractions import Fraction

from flint import arb, arb_mat, ctx

from functions import Family, Sum, alone, blocks, diagonal, function, less_squares, require, unit

JOINED = 6  # cells that carry nothing are taken as one, so many at a time
SERIES = 24  # terms of the exponential series
# A quotient of parameters is meant exactly or as the double nearest to it: both are in this ball around it.
ROUNDED = arb(1, 2.0**-50)
QUADROTOR = "mass_kg gravity_m_s2 inertia_x_kg_m2 inertia_y_kg_m2 inertia_z_kg_m2 arm_length_m drag_to_lift_m".split()
# ẋ₁ = x₂, ẋ₂ = u; of the pendulum ẋ₂ = -0.1 x₂ + sin x₁ + u
PLANTS = {"double-integrator": ([[0, 1], [0, 0]], [[0], [1]]), "pendulum": ([[0, 1], [1, -0.1]], [[0], [1]])}
# The cubic through the knots -1, 0, 1, 2: of each the weight, in sixths of 1, t, t², t³.
CUBIC = {-1: (0, -2, 3, -1), 0: (6, -3, -6, 3), 1: (0, 6, 3, -3), 2: (0, -1, 0, 1)}


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


def close(off, size, most, why):
    """Whether all entries of a ball matrix are below `most`, relative to a matrix of this size."""
    require(all(x.abs_upper() < most * size for x in off.entries()), why)


def plant_of(plant):
    """A(ρ) = ∂f/∂x and B(ρ) = ∂f/∂u at rest, u*, and where ρ is in x; derived by hand from ẋ = f(x, u)."""
    if plant["name"] == "quadrotor":
        # v̇ = (sin θ, -sin φ cos θ, cos φ cos θ) ΣF/m - (0, 0, g), ṙ = v,
        # ṗ = (F₂ - F₄)ℓ/I_x - …qr, q̇ = (F₃ - F₁)ℓ/I_y - …pr, ṙ = (F₁ - F₂ + F₃ - F₄)d/I_z - …pq,
        # φ̇ = (p cos ψ - q sin ψ)/cos θ, θ̇ = p sin ψ + q cos ψ, ψ̇ = r - (p cos ψ - q sin ψ) tan θ; at rest F = mg/4
        require(all(plant[key] > 0 for key in QUADROTOR), "a parameter of the quadrotor is not positive")
        mass, g, ix, iy, iz, arm, drag = (arb(plant[key]) for key in QUADROTOR)
        g, by_mass, p, q, r = (ROUNDED * x for x in (g, 1 / mass, arm / ix, arm / iy, drag / iz))
        still = {(3, 0): 1, (4, 1): 1, (5, 2): 1, (11, 8): 1, (0, 10): g, (1, 9): -g}
        cosine, sine = {(9, 6): 1, (10, 7): 1}, {(9, 7): -1, (10, 6): 1}
        b = {(2, 0): by_mass, (2, 1): by_mass, (2, 2): by_mass, (2, 3): by_mass}
        b |= {(6, 1): p, (6, 3): -p, (7, 2): q, (7, 0): -q, (8, 0): r, (8, 1): -r, (8, 2): r, (8, 3): -r}
        fill = lambda entries, columns: arb_mat([[entries.get((i, j), 0) for j in range(columns)] for i in range(12)])
        a = [((0, 0, 0, ()), fill(still, 12)), ((0, 1, 0, ()), fill(cosine, 12)), ((0, 1, 1, ()), fill(sine, 12))]
        return Sum((12, 12), a), Sum.constant(fill(b, 4)), [plant["mass_kg"] * plant["gravity_m_s2"] / 4] * 4, 11
    a, b = (plant["A"], plant["B"]) if plant["name"] == "linear" else PLANTS[plant["name"]]
    return Sum.constant(a), Sum.constant(b), [0.0] * len(b[0]), None


def after_a_sample(h, w, time):
    """By Schur, with H = PE (or EY): where it is positive definite, V(x + τEx) < V(x) for every τ ≤ T."""
    return blocks([[(h + h.transpose()) * -1, h.transpose() * time], [h * time, w * time]])


class Loop:
    """ẋ = Ax + Bu, u = -Kx within limits, and V = xᵀPx or, if `inverse`, V = xᵀY⁻¹x: of designs and polytopes.

    The method of a theorem yields what has to be definite on a piece of the parameter's range, for `Family`.
    """

    parameter, pieces, vertices, low, omega = None, 1, 0, arb(0), arb(0)

    def start(self, line, a, b):
        self.line, self.a, self.b, (self.n, self.m) = line, a, b, b.shape
        self.gains = functools.cache(self.gains)
        if line["weights"]:
            q, r = line["weights"]["q"], line["weights"]["r"]
            symmetric(q, self.n, "Q"), symmetric(r, self.m, "R")
            require(semidefinite(q, False) and semidefinite(r, True), "Q is not ⪰ 0, or R not ≻ 0")
            self.q, self.r = Sum.constant(q), Sum.constant(r)

    def limit(self, sigma, has_auxiliary):
        """Inputs that lie between rows of F and K on the set, and those that could reach a limit."""
        self.sigma, limited = sigma, [i for i in range(self.m) if sigma[i] is not None]
        self.saturating = limited if has_auxiliary else []
        low = [self.gains(piece)[1] for piece in range(self.pieces)]
        self.limited = [i for i in limited if not all(k.rows([i]).is_zero() for k in low)]
        require(all(sigma[i] > 0 for i in self.limited), "an input that moves has no room")

    def variants(self, kind):
        """Of a claim: inputs that could reach a limit, or lists of inputs that fly K while others fly F."""
        if kind == "unsaturated":
            return self.limited
        if kind not in ("decrease", "cost", "sampled-cost") or not self.saturating:
            return [None]
        chosen = itertools.product((False, True), repeat=len(self.saturating))
        return [list(itertools.compress(self.saturating, bits)) for bits in chosen]

    def mixed(self, inputs, high, low):
        """Rows of `high` for these inputs, of `low` for others."""
        picked = [i in inputs for i in range(self.m)]
        return Sum.constant(diagonal(picked)) @ high + Sum.constant(diagonal([not x for x in picked])) @ low

    def gains(self, piece):
        """K, and the rows that are not to saturate; both times Y if `inverse`."""
        k = self.scheduled(piece)
        return k, self.mixed(self.saturating, self.auxiliary, k) if self.saturating else k

    def shows(self, theorem, claim, group):
        """Whether the matrices of a theorem are definite on the cells of a group."""
        piece = group["piece"]
        cells = [[a - piece, b - piece, more[0] if more else None] for a, b, *more in group["cells"]]
        if not any(extra for *_, extra in cells):  # then cells are no more than a hint how wide they may be
            several = [cells[k : k + JOINED] for k in range(0, len(cells), JOINED)]
            cells = [[some[0][0], some[-1][1], None] for some in several]
        for parts, finish in theorem(self, claim, piece, group["variant"]):
            degree = max(len(v) for part in parts for *_, v in part.terms)
            each = zip(*(part.by_vertices(self.vertices, degree) for part in parts)) if self.vertices else [parts]
            families = (Family((self.low + self.omega * piece, self.omega), part, finish) for part in each)
            if not all(family.is_definite_on(cells) for family in families):
                return False
        return True

    def definite(self, claim, piece, variant):
        yield [self.lyapunov], alone

    def bounded(self, claim, piece, variant):
        """Y ⪰ floor I, which is P ⪯ I/floor."""
        one, floor = Sum.constant(unit(self.n)), claim["floor"]
        yield [self.lyapunov - one.times(floor) if self.inverse else one - self.lyapunov.times(floor)], alone

    def unsaturated(self, claim, piece, i):
        """P - γfᵀf/σ² ≻ 0, or the same with Y and fY: (fx)² < σ² where V ≤ γ."""
        sigma = arb(self.sigma[i].numerator) / self.sigma[i].denominator
        finish = lambda parts, _: parts[0] - parts[1].transpose() * parts[1] * (arb(claim["level"]) / sigma**2)
        yield [self.lyapunov, self.gains(piece)[1].rows([i])], finish

    def falling(self, claim, piece, flying):
        """-V̇ - ratio (xᵀQx + uᵀRu) > 0, input rows of K where they are `flying`, the others of F.

        V = xᵀPx:     -(P(A - BS) + ·ᵀ + ρ̇ P′) - ratio (Q + SᵀRS)
        V = xᵀY⁻¹x:   -(AY - BG + ·ᵀ) + ρ̇ Y′ - ratio (YQY + GᵀRG),  G = SY, between Y⁻¹

        With flying = "rows" an input is f x + θ(k - f)x, 0 ≤ θ ≤ 1, and θ² ≤ θ: the form is at least that of S = F less
        Σ θ (dᵢx)(gᵢx), d = k - f, g = ratio rᵢ(k + f) - 2bᵢᵀP (`less_squares`).
        """
        w, (k, low), by_rows = self.lyapunov, self.gains(piece), flying == "rows"
        s = self.mixed(flying, k, low) if flying and not by_rows else low
        flow = self.b @ s - self.a @ w if self.inverse else w @ (self.b @ s - self.a)
        flow, push = flow + flow.t, (self.b if self.inverse else w @ self.b).t.times(-2)
        if claim["kind"] == "cost":
            ratio = 1 / arb(claim["factor"])
            flow -= ((w @ self.q @ w if self.inverse else self.q) + s.t @ self.r @ s).times(ratio)
            push += (self.r @ (k + low)).times(ratio)
        r = self.line["weights"]["r"] if by_rows else []
        require(not any(x for i, row in enumerate(r) for j, x in enumerate(row) if i != j), "R is not diagonal")
        for motion in self.motions(claim):
            base = flow + motion if self.inverse else flow - motion
            rows = [push.rows(self.saturating), (k - low).rows(self.saturating)] if by_rows else []
            yield [base, *rows], less_squares if by_rows else alone


class Design(Loop):
    """A plant and the design for it."""

    def __init__(self, line):
        controller, self.points, self.pieces = line["controller"], line["points"], line["pieces"]
        a, b, self.trim, self.parameter = plant_of(line["plant"])
        self.start(line, a, b)
        require(controller["operating_input"] == self.trim, "the operating input is not that of the plant")
        require(controller["scheduling_state"] == self.parameter, "the scheduling state is not that of the plant")
        constant = lambda key: {"basis": [{"function": "constant"}], "coefficients": [self.points[0][key]]}
        lyapunov, auxiliary = constant("p"), constant("auxiliary_gain")
        if self.parameter is None:
            require(self.pieces == len(self.points) == 1, "pieces are wrong")
        else:  # ρ = -π + ω t, t from 0 to the number of pieces, once around the circle
            require(0 < self.pieces <= 4096, "pieces are wrong")
            self.low, self.omega = arb(-math.pi), 2 * arb.pi() / self.pieces
        self.inverse = line.get("rate_bounded") is not None
        if self.inverse:
            lyapunov, auxiliary = line["rate_bounded"]["y"], line["rate_bounded"]["l"]
        elif self.parameter is not None:
            lyapunov, auxiliary = line["joined"]["p"], line["joined"]["auxiliary"]
        for rows in [*lyapunov["coefficients"], *(point["p"] for point in self.points)]:
            symmetric(rows, self.n, "a matrix of the Lyapunov function")
        has_auxiliary = {point["auxiliary_gain"] is not None for point in self.points}
        require(len(has_auxiliary) == 1, "some auxiliary gains are missing")
        self.lyapunov = function(lyapunov, (self.n, self.n))
        self.auxiliary = function(auxiliary, (self.m, self.n)) if True in has_auxiliary else None
        self.check_schedule(controller["schedule"])
        self.check_points()
        sigma = [self.room(controller["limits"], i) for i in range(self.m)]
        require(all(s is None or s >= 0 for s in sigma), "an input rests beyond its limits")
        self.limit(sigma, True in has_auxiliary)

    def room(self, limits, i):
        """σᵢ: |uᵢ - u*ᵢ| ≤ σᵢ is within the limits; None where there are none."""
        sides = [(limits["max"][i], 1), (limits["min"][i], -1)]
        return min((s * (Fraction(end) - Fraction(self.trim[i])) for end, s in sides if end is not None), default=None)

    def check_schedule(self, schedule):
        """Knots are where they should be, and gains at knots those of the points."""
        turns, gains, rhos = self.parameter is not None, *([p[key] for p in self.points] for key in ("gain", "rho"))
        require(turns or rhos == [0.0], "there is no parameter")
        for k, rho in enumerate(rhos):
            off = arb(rho) - self.low - 2 * arb.pi() * k / len(rhos)
            require(off.abs_upper() < 1e-12, "a grid point is not where it should be")
        if schedule["kind"] == "grid":
            require(turns and len(gains) == self.pieces > 3, "the knots are wrong")
            require(abs(schedule["period"] - 2 * math.pi) < 1e-12, "the gains are not periodic")
            require(schedule["parameters"] == rhos, "knots differ from grid points")
            require(schedule["gains"] == gains, "scheduled gains differ from those of the grid points")
        elif schedule["kind"] == "constant":
            require([schedule["gain"]] == gains, "the gain differs from that of the point")
        else:
            require(schedule["kind"] == "vertices" and turns, "the schedule is not known")
            corners = itertools.product((-1.0, 1.0), repeat=len(schedule["weights"]["features"]))
            require(sorted(map(tuple, schedule["weights"]["corners"])) == list(corners), "they are no box's corners")
            for rho, gain in zip(rhos, gains):
                size = max(abs(x) for row in gain for x in row)
                close(self.schedule(0).at(arb(rho)) - arb_mat(gain), size, 1e-3, "the gain is far from the points'")

    def check_points(self):
        """P (and F) of the points is that of the function up to rounding: PY = I, or P and F have its harmonics."""
        if self.inverse:
            for point in self.points:
                off = self.lyapunov.at(arb(point["rho"])) * arb_mat(point["p"]) - unit(self.n)
                close(off, 1, 1e-6, "P of a point is not the inverse of Y")
        elif self.parameter is not None:
            pairs, count = [(self.lyapunov, "p"), (self.auxiliary, "auxiliary_gain")], len(self.points)
            for (total, key), k, s in itertools.product(pairs, range((count + 1) // 2), (0, 1)):
                if total is not None:
                    require(all(2 * order < count for _, order, *_ in total.terms), "a harmonic is of no point")
                    waves = [(arb(p["rho"]) * k).sin_cos()[1 - s] * (2 if k else 1) / count for p in self.points]
                    given, zero = [arb_mat(p[key]) for p in self.points], arb_mat(*total.shape)
                    off = sum((p * w for p, w in zip(given, waves)), zero) - total.terms.get((0, k, s, ()), zero)
                    close(off, max(map(abs, given[0].entries())), 1e-10, "a harmonic is not the points'")

    def schedule(self, piece):
        """K on a piece: the cubic in t through the knots before, at both ends and after it; or Σ wᵢ(ρ)Kᵢ."""
        shape, schedule, pairs = (self.m, self.n), self.line["controller"]["schedule"], []
        if schedule["kind"] == "constant":
            return Sum.constant(schedule["gain"])
        if schedule["kind"] == "vertices":
            for corner, gain in zip(schedule["weights"]["corners"], schedule["gains"], strict=True):
                weight = Sum.constant([[1]])  # Π (1 + c feature)/2
                for c, feature in zip(corner, schedule["weights"]["features"], strict=True):
                    wave = ((0, 1, {"cos": 0, "sin": 1}[feature], ()), arb_mat([[c / 2]]))
                    weight @= Sum.constant([[0.5]]) + Sum((1, 1), [wave])
                pairs += [(key, arb_mat(gain) * w[0, 0]) for key, w in weight.terms.items()]
            return Sum(shape, pairs)
        for knot, weights in CUBIC.items():
            gain = arb_mat(schedule["gains"][(piece + knot) % self.pieces])
            pairs += [((j, 0, 0, ()), gain * (arb(weight) / 6)) for j, weight in enumerate(weights)]
        return Sum(shape, pairs)

    def scheduled(self, piece):
        return self.schedule(piece) @ self.lyapunov if self.inverse else self.schedule(piece)

    def motions(self, claim):
        """ρ̇ P′ at the largest rates."""
        return [self.lyapunov.slope(0, rate) for rate in {-claim["rate"], claim["rate"]}]

    def held(self, time):
        """(AT)^k/(k + 1)!, k = 0, 1, …, with the rest of the series as the last: x(T) = x + TΦ(Ax + Bu) while u is held
        for T, where Φ is their sum."""
        terms = [Sum.constant(unit(self.n))]
        while terms[-1].terms and len(terms) <= SERIES:
            terms.append((terms[-1] @ self.a).times(arb(time) / (len(terms) + 1)))
        if terms[-1].terms:  # Σ_{k > N} a^k/(k + 1)! ≤ 2 a^{N+1}/(N + 2)! for the norm a ≤ N/2 of AT
            require(self.parameter is None, "the series of a plant with a parameter does not end")
            rows = self.a.times(time).at(arb(0)).tolist()
            norm = functools.reduce(arb.max, (sum(map(arb.abs_upper, row)) for row in rows))
            require(norm < SERIES / 2, "the sample time is too long")
            rest = arb(0, (2 * norm ** (SERIES + 1) / arb.fac_ui(SERIES + 2)).abs_upper())
            terms.append(Sum.constant([[rest] * self.n] * self.n))
        return terms

    def kept(self, claim, piece, variant):
        """V is smaller at the next sample than at x, of every v between Fx and Kx that is held; of each φ a matrix.

        x(τ) = x + τEx, E = φ(A - BS), v = Sx. `after_a_sample` is affine in E and so in S: row i adds θ(uwᵀ + wuᵀ),
        u = (d, 0), w = (η, -Tη), η = Pφbᵢ, which is -θ(u·)(g·), g = -2w, as in `less_squares`. At the sample φ = Φ. For
        all τ = sT, N = AT: φ = I + sN/2 + s²N²/6 + s³(…), by Bernstein's polynomials a convex combination of I, I + N/4
        and I + N/2 + N²/6, and what follows, N^k s^k/(k + 1)!, is in [0, 1] N^k/(k + 1)!.
        """
        w, (k, low), time, between = self.lyapunov, self.gains(piece), arb(claim["sample_time_s"]), claim["between"]
        flow, terms = (self.a @ w if self.inverse else self.a) - self.b @ low, self.held(time)

        def falls(parts, weights):
            h, w, *rows = parts
            base = after_a_sample(h, w, time)
            if not rows:
                return base
            push, difference = ([[rows[0] * -2, rows[0] * (2 * time)]], [[rows[1], rows[1] * 0]])
            return less_squares([base, blocks(push), blocks(difference)], weights)
        for share in [(0, 0), (0.5, 0), (1, 1)] if between else [(1, 1)]:
            weights = [1, *share] + [arb(0.5, 0.5) if between else 1] * len(terms)
            phi = sum((term.times(weight) for term, weight in zip(terms, weights)), Sum((self.n, self.n)))
            h, eta = (phi @ x if self.inverse else w @ phi @ x for x in (flow, self.b))
            yield [h, w, *(x.rows(self.saturating) for x in (eta.t, k - low) if self.saturating)], falls

    def sampled(self, claim, piece, variant):
        """xᵀXx, X of the cell, is smaller at the next sample: x₊ = (I + TE)x, E = Φ(A - BK), if u is held for T."""
        time, phi = arb(claim["sample_time_s"]), sum(self.held(claim["sample_time_s"]), Sum((self.n, self.n)))
        falls = lambda parts, x: after_a_sample(arb_mat(x) * parts[0], arb_mat(x), time)
        yield [phi @ (self.a - self.b @ self.schedule(piece))], falls

    def sampled_cost(self, claim, piece, flying):
        """factor (P - MᵀPM) - ZᵀWZ of one mixture, v = Sx held for T: over a period V falls by the cost, or more.

        z(τ) = e^{Gτ}Zx for z = (x, v), G = [A, -B; 0, 0], Z = [I; S]; M is the upper part of e^{GT}Z, and the cost is
        zᵀWz, W = ∫₀ᵀ e^{Gᵀτ}Ce^{Gτ} dτ, C = [Q, 0; 0, R]. Van Loan: e^{XT} = [·, N; 0, e^{GT}] for X = [-Gᵀ, C; 0, G],
        and W = (e^{GT})ᵀN. The difference is concave in v, and so least at a mixture.
        """
        require(self.parameter is None and not self.inverse, "it is of a plant without a parameter, and of P")
        n, m, s = self.n, self.m, self.mixed(flying or [], *self.gains(piece))
        a, b, q, r, p, s = (x.at(arb(0)) for x in (self.a, self.b, self.q, self.r, self.lyapunov, s))
        with ctx.workprec(256):
            g = blocks([[a, b * -1], [arb_mat(m, n + m)]])
            c = blocks([[q, arb_mat(n, m)], [arb_mat(m, n), r]])
            x = blocks([[g.transpose() * -1, c], [arb_mat(n + m, n + m), g]])
            right = [row[n + m :] for row in (x * arb(claim["sample_time_s"])).exp().tolist()]
            z = blocks([[unit(n)], [s]])
            beside, end = arb_mat(right[: n + m]) * z, arb_mat(right[n + m :]) * z
            moved = arb_mat(end.tolist()[:n])
            left = (p - moved.transpose() * p * moved) * arb(claim["factor"]) - end.transpose() * beside
        yield [Sum.constant(left)], alone


class Polytope(Loop):
    """A(ρ) = Σ ρᵢAᵢ, B(ρ) = Σ ρᵢBᵢ; V = xᵀPx, u = -Σ ρᵢKᵢx, or V = xᵀ(Σ ρᵢYᵢ)⁻¹x, u = -(Σ ρᵢLᵢ)(Σ ρᵢYᵢ)⁻¹x."""

    def __init__(self, line):
        self.inverse, self.vertices = "P" not in line, len(line["A"])
        n, m, f, sigma = len(line["B"][0]), len(line["B"][0][0]), line["F"], line["sigma"]

        def all_of(matrices, rows, columns):
            require(len(matrices) == self.vertices, "a vertex is missing")
            return Sum((rows, columns), [((0, 0, 0, (i,)), arb_mat(matrix)) for i, matrix in enumerate(matrices)])
        self.start(line, all_of(line["A"], n, n), all_of(line["B"], n, m))
        self.y, self.rates = (line["Y"], line["rate_vertices"]) if self.inverse else ([], [[0.0] * self.vertices])
        for rows in self.y or [line["P"]]:
            symmetric(rows, n, "P or Y")
        self.lyapunov = all_of(self.y, n, n) if self.inverse else Sum.constant(line["P"])
        for rates in self.rates:
            off = abs(sum(map(Fraction, rates)))
            require(len(rates) == self.vertices and off <= 1e-9 * max(map(abs, rates)), "rates do not sum to zero")
        require(self.rates, "rate vertices are missing")
        require(sigma is None or len(sigma) == m and all(s is None or s > 0 for s in sigma), "sigma is wrong")
        self.gain = all_of(line["L" if self.inverse else "K"], m, n)
        low = [arb_mat(x) * arb_mat(y) for x, y in zip(f, self.y)] if f and self.inverse else f
        self.auxiliary = all_of(low, m, n) if f else None
        self.limit([None if s is None else Fraction(s) for s in sigma or [None] * m], f)

    def scheduled(self, piece):
        return self.gain

    def motions(self, claim):
        pairs = lambda rates: [((0, 0, 0, ()), arb_mat(y) * arb(rate)) for y, rate in zip(self.y, rates)]
        return [Sum((self.n, self.n), pairs(rates)) for rates in self.rates]
