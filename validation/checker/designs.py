"""Designs and polytopes of a record: the plant's linearisation, the closed loop, and the matrices of each theorem."""
import itertools
import math
from fractions import Fraction
from functools import reduce
from operator import add

from flint import arb, arb_mat, ctx

from functions import Family, Sum, ball, blocks, bordered, function, require, unit

SERIES = 24  # terms of the exponential series
# A quotient of parameters is meant exactly or as the double nearest to it: both are in this ball around it.
ROUNDED = arb(1, 2.0**-50)


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

    def sampled_cost(self, flying, time, factor):
        """factor (P - MᵀPM) - ZᵀWZ of one mixture, v = Sx held for T: over a period V falls by the cost, or more.

        z(τ) = e^{Gτ}Zx for z = (x, v), G = [A, -B; 0, 0], Z = [I; S]; M is the upper part of e^{GT}Z, and the cost is
        zᵀWz, W = ∫₀ᵀ e^{Gᵀτ}Ce^{Gτ} dτ, C = [Q, 0; 0, R], which Van Loan's exponential has beside e^{GT}: e^{XT} =
        [·, N; 0, e^{GT}], X = [-Gᵀ, C; 0, G], W = (e^{GT})ᵀN. As a function of v the difference is concave, so that it
        is least at a mixture.
        """
        require(self.parameter is None and not self.inverse, "it is of a plant without a parameter, and of P")
        n, size, (k, low) = self.n, self.n + self.m, self.gains(0)
        zero, zeros = lambda rows, columns: Sum((rows, columns), {}), Sum((size, size), {})
        s = blocks([[(k if i not in self.saturating or i in flying else low).rows([i])] for i in range(self.m)])
        g = blocks([[self.a, self.b.times(-1)], [zero(self.m, n), zero(self.m, self.m)]])
        c = blocks([[Sum.constant(self.q), zero(n, self.m)], [zero(self.m, n), Sum.constant(self.r)]])
        with ctx.workprec(256):
            whole = (blocks([[g.t.times(-1), c], [zeros, g]]).at(arb(0)) * arb(time)).exp().tolist()
            z, p = blocks([[unit(n)], [s]]).at(arb(0)), self.lyapunov.at(arb(0))
            flow, beside = (arb_mat([row[size:] for row in rows]) for rows in (whole[size:], whole[:size]))
            next_state = arb_mat((flow * z).tolist()[:n])
            cost = z.transpose() * flow.transpose() * beside * z
            return (p - next_state.transpose() * p * next_state) * arb(factor) - cost


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
