#!/usr/bin/env python3
"""Optima of synthesis problems over polytopes, by solvers that share nothing with ours.

The inequalities of Lemma 4.1 and Theorems 2.1, 4.1-4.4 and 5.1-5.4 are written here again, with cvxpy, and solved by two of Clarabel,
CVXOPT and SCS. High gain is posed with all its 2^m inequalities, though ours leaves them out for diagonal R. An optimum is kept only where
two solvers call theirs optimal and agree to 2e-7 relatively; problems whose optimum is not attained (the least bound of one state with
nothing that holds the other directions) make these solvers stop early and are not here. The result is the file that the tests read:

    pip install cvxpy clarabel cvxopt scs
    python3 polytopic.py > ../../crates/lpv/tests/it/data/polytopic.json

Models outside the thesis: two masses and a spring of uncertain stiffness with an actuator of uncertain strength
(Wie and Bernstein, "Benchmark problems for robust control design", 1992), the translational oscillator with rotational
actuator (Bupp, Bernstein and Coppola, "A benchmark problem for nonlinear control design", 1998) between four vertices, chains of
integrators with two saturated inputs, lateral motion of a hovering vehicle over an arc of yaw; and the thesis's pendulum, double
integrator and quadrotor, the last as (3.34) at points of an arc of yaw.
"""

import itertools
import json
import sys
from importlib.metadata import version

import cvxpy as cp
import numpy as np

AGREEMENT = 2e-7


def two_masses(k, strength):
    a = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-k, k, 0, 0], [k, -k, 0, 0]], float)
    return a, strength * np.array([[0], [0], [1], [0]], float)


def tora(c, s):
    """State x1, x1', angle, angular speed; coupling 0.2; c and s stand for cos and sin terms."""
    e = 0.2
    d = 1 - e * e * c * c
    a = np.array([[0, 1, 0, 0], [-1 / d, 0, 0, e * s / d], [0, 0, 0, 1], [e * c / d, 0, 0, -e * e * c * s / d]])
    return a, np.array([[0], [-e * c / d], [0], [1 / d]])


def arc(psi):
    """Position and velocity in the plane, roll, pitch with their rates: the lateral motion at yaw psi."""
    g = 9.81
    a = np.zeros((8, 8))
    a[0, 2] = a[1, 3] = 1
    a[2:4, 4:6] = g * np.array([[np.sin(psi), np.cos(psi)], [-np.cos(psi), np.sin(psi)]])
    a[4, 6] = a[5, 7] = 1
    b = np.zeros((8, 2))
    b[6, 0] = b[7, 1] = 4
    return a, b


def quadrotor(psi, m=2.0, g=9.807, ix=1.25, iy=1.25, iz=2.5, arm=0.3, drag=0.075):
    """(3.34) and (3.29) at hover, Table 6.1: v_x v_y v_z r_x r_y r_z p q r phi theta psi."""
    a = np.zeros((12, 12))
    a[0, 10], a[1, 9] = g, -g
    a[3, 0] = a[4, 1] = a[5, 2] = a[11, 8] = 1
    a[9:11, 6:8] = [[np.cos(psi), -np.sin(psi)], [np.sin(psi), np.cos(psi)]]
    b = np.zeros((12, 4))
    b[2] = 1 / m
    b[6, 1], b[6, 3] = arm / ix, -arm / ix
    b[7, 0], b[7, 2] = -arm / iy, arm / iy
    b[8] = np.array([1, -1, 1, -1]) * drag / iz
    return a, b


def chain(n, last=-0.5, strength=1.0):
    a = np.diag(np.ones(n - 1), 1)
    a[n - 1, 0] = last
    b = np.zeros((n, 2))
    b[0, 1], b[n // 2, 0], b[n - 1, 1] = 0.3, strength, 1
    return a, b


def pairwise_rates(count, bound):
    """Weight moves from one vertex to another."""
    rates = []
    for i, j in itertools.permutations(range(count), 2):
        nu = [0.0] * count
        nu[i], nu[j] = bound, -bound
        rates.append(nu)
    return rates


def problems():
    def problem(name, vertices, q=None, r=None, rates=None, bounds=None, high_gain=False, objective=None):
        full = lambda m: None if m is None else (np.diag(m) if np.ndim(m) == 1 else np.array(m, float))
        return dict(name=name, vertices=vertices, q=full(q), r=full(r), rates=rates, bounds=bounds,
                    high_gain=high_gain, objective=objective or {"kind": "trace"})

    pendulum = [(np.array([[0, 1], [a, -0.1]]), np.array([[0.0], [1]])) for a in (1.0, 0.0)]
    integrator = [(np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1]]))]
    masses = [two_masses(k, strength) for k, strength in [(0.5, 1.0), (2.0, 0.8), (1.0, 1.3)]]
    oscillator = [tora(c, s) for c, s in itertools.product([0.8, 1.0], [-0.2, 0.2])]
    lateral = [arc(psi) for psi in np.linspace(-0.5, 0.5, 3)]
    vehicle = [quadrotor(psi) for psi in np.linspace(-np.pi / 6, np.pi / 6, 3)]
    chains = [chain(3), chain(3, 0.3, 1.4)]
    nu = 0.43618182 * 2
    mass_weights = ([1, 1, 0.1, 0.1], [1])
    chain_full = ([1.0, 2, 3], [[0.1, 0.05], [0.05, 0.2]])
    lateral_weights = ([1, 1, 0.5, 0.5, 1, 1, 0.1, 0.1], [0.1, 0.1])
    vehicle_weights = ([1, 1, 100, 1, 1, 50, 50, 50, 50, 1, 1, 100], [0.001] * 4)

    yield problem("pendulum, common", pendulum, [4, 4], [1])
    yield problem("pendulum, rate 2", pendulum, [4, 4], [1], [[nu, -nu], [-nu, nu]])
    yield problem("pendulum, initial state", pendulum, [4, 4], [1], objective={"kind": "states", "states": [[np.pi, 0]]})
    yield problem("pendulum, rate 2, initial state and parameter", pendulum, [4, 4], [1], [[nu, -nu], [-nu, nu]],
                  objective={"kind": "states", "states": [[np.pi, 0]], "parameter": [0, 1]})
    yield problem("double integrator, regulator", integrator, [1, 1], [0.001])
    yield problem("double integrator, saturated", integrator, [1, 1], [0.001], bounds=([1.0], 30.0))
    yield problem("double integrator, high gain", integrator, [1, 1], [0.001], bounds=([1.0], 30.0), high_gain=True)
    yield problem("two masses, common", masses, *mass_weights)
    yield problem("two masses, rates", masses, *mass_weights, pairwise_rates(3, 0.2))
    yield problem("two masses, saturated", masses, *mass_weights, bounds=([1.5], 4.0))
    yield problem("two masses, saturated, rates", masses, *mass_weights, pairwise_rates(3, 0.2), ([1.5], 4.0))
    yield problem("two masses, high gain", masses, *mass_weights, bounds=([1.5], 4.0), high_gain=True)
    yield problem("two masses, worst of states", masses, *mass_weights, bounds=([1.5], 4.0),
                  objective={"kind": "states", "states": [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})
    yield problem("two masses, ellipsoid", masses, *mass_weights, bounds=([1.5], 4.0),
                  objective={"kind": "ellipsoid", "shape": np.diag([1.0, 2, 1, 0.5]).tolist()})
    yield problem("two masses, output alone costs", masses, np.outer([0, 1, 0, 0], [0, 1, 0, 0]) + 0.1 * np.outer([1, 0, 0, 0], [1, 0, 0, 0]), [1])
    yield problem("two masses, stabilise", masses)
    yield problem("two masses, stabilise, rates", masses, rates=pairwise_rates(3, 0.2))
    yield problem("oscillator, common", oscillator, [1, 1, 1, 1], [0.5])
    yield problem("oscillator, rates", oscillator, [1, 1, 1, 1], [0.5], pairwise_rates(4, 0.1))
    yield problem("oscillator, saturated", oscillator, [1, 1, 1, 1], [0.5], bounds=([0.5], 2.0))
    yield problem("oscillator, stabilise", oscillator)
    yield problem("chain of two inputs, saturated", [chain(3)], [1, 2, 3], [0.1, 0.2], bounds=([1.0, 0.5], 10.0))
    yield problem("chain of two inputs, high gain", [chain(3)], [1, 2, 3], [0.1, 0.2], bounds=([1.0, 0.5], 10.0), high_gain=True)
    yield problem("chain of two inputs, high gain, general R", [chain(3)], *chain_full, bounds=([1.0, 0.5], 10.0), high_gain=True)
    yield problem("two chains, high gain, general R", chains, *chain_full, bounds=([1.0, 0.5], 10.0), high_gain=True)
    yield problem("two chains, high gain, general R, rates", chains, *chain_full, [[0.3, -0.3], [-0.3, 0.3]], ([1.0, 0.5], 10.0), True)
    yield problem("two chains of four, region", [chain(4), chain(4, 0.2)], [1, 1, 1, 1], [0.1, 0.2], bounds=([1.0, 0.5], 10.0),
                  objective={"kind": "states", "states": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})
    yield problem("lateral motion on an arc, common", lateral, *lateral_weights)
    yield problem("lateral motion on an arc, stabilise", lateral)
    yield problem("quadrotor on an arc of 30 degrees, common", vehicle, *vehicle_weights)
    yield problem("quadrotor on an arc of 30 degrees, saturated", vehicle, *vehicle_weights, bounds=([2.0 * 9.807 / 4] * 4, 10.0))
    yield problem("quadrotor on an arc of 30 degrees, rates", vehicle, *vehicle_weights, pairwise_rates(3, 0.5))
    yield problem("quadrotor on an arc of 30 degrees, stabilise", vehicle)


def pose(vertices, q, r, rates, bounds, high_gain, objective, **_):
    """The blocks as printed in the thesis, with the corrections of signs and factors; without Q the margin of stability."""
    n, m, count = vertices[0][0].shape[0], vertices[0][1].shape[1], len(vertices)
    # units of states and inputs in which Q and R have ones on the diagonal: these solvers need it where entries differ by 10^5
    unit, input_unit = np.ones(n), np.ones(m)
    if q is not None and (np.diag(q) > 0).all():
        unit, input_unit = np.diag(q) ** -0.5, np.diag(r) ** -0.5
        q, r = q * np.outer(unit, unit), r * np.outer(input_unit, input_unit)
        vertices = [(a * np.outer(1 / unit, unit), b * np.outer(1 / unit, input_unit)) for a, b in vertices]
    common = rates is None
    shared = cp.Variable((n, n), symmetric=True)
    ys = [shared] * count if common else [cp.Variable((n, n), symmetric=True) for _ in range(count)]
    distinct = ys[:1] if common else ys
    ls = [cp.Variable((m, n)) for _ in range(count)]
    ms = [cp.Variable((m, n)) for _ in range(count)] if high_gain else ls
    bound = cp.Variable()
    constraints = []

    def positive(block):
        constraints.append((block + block.T) / 2 >> 0)

    if q is not None:
        values, vectors = np.linalg.eigh(q)
        kept = values > 1e-12 * values.max()
        output = (vectors[:, kept] * np.sqrt(values[kept])).T
        r_inverse = np.linalg.inv(r)
    for nu in [None] if common else rates:
        rate = 0 if common else sum(nu[i] * ys[i] for i in range(count))
        for mixture in itertools.product([0.0, 1.0], repeat=m) if high_gain else [None]:
            def gain(i):
                return ls[i] if mixture is None else np.diag(mixture) @ ls[i] + np.diag(1 - np.array(mixture)) @ ms[i]

            def flow(i, j):
                return vertices[i][0] @ ys[j] - vertices[i][1] @ gain(j)
            for i, j in itertools.combinations_with_replacement(range(count), 2):
                f = flow(i, i) if i == j else flow(i, j) + flow(j, i)
                y, l, w = (ys[i], gain(i), 1) if i == j else (ys[i] + ys[j], gain(i) + gain(j), 2)
                decrease = w * rate - f - f.T
                if q is None:
                    positive(decrease - w * bound * np.eye(n))
                    continue
                zero = np.zeros((output.shape[0], m))
                positive(cp.bmat([[decrease, (output @ y).T, l.T],
                                  [output @ y, w * np.eye(output.shape[0]), zero], [l, zero.T, w * r_inverse]]))
    for y in distinct:
        positive(y)
        if q is None:
            constraints.append(cp.trace(y) <= n)
    if bounds:
        sigma, gamma = bounds
        for y, l in zip(ys, ms):
            for i in range(m):
                row = cp.reshape(l[i, :], (1, n), order="C")
                positive(cp.bmat([[np.array([[(sigma[i] / input_unit[i]) ** 2 / gamma]]), row], [row.T, y]]))
    if q is None:
        return cp.Problem(cp.Maximize(bound), constraints)
    if objective["kind"] == "trace":
        return cp.Problem(cp.Maximize(sum(unit**2 @ cp.diag(y) for y in distinct)), constraints)
    if objective["kind"] == "ellipsoid":
        for y in distinct:
            positive(cp.bmat([[bound * (np.array(objective["shape"]) * np.outer(unit, unit)), np.eye(n)], [np.eye(n), y]]))
    else:
        rho = objective.get("parameter")
        at = distinct if rho is None else [sum(weight * y for weight, y in zip(rho, ys))]
        for state in objective["states"]:
            x = (np.array(state, float) / unit).reshape(n, 1)
            for y in at:
                positive(cp.bmat([[cp.reshape(bound, (1, 1), order="C"), x.T], [x, y]]))
    return cp.Problem(cp.Minimize(bound), constraints)


# tolerances from tight to loose: these solvers fail rather than stop where rounding ends their progress
SETTINGS = {
    "CLARABEL": [dict(tol_gap_abs=t, tol_gap_rel=t, tol_feas=t, max_iter=200) for t in (1e-9, 1e-8)],
    "CVXOPT": [dict(abstol=t, reltol=t, feastol=t, max_iters=100) for t in (1e-9, 1e-8, 1e-7)],
    "SCS": [dict(eps_abs=1e-8, eps_rel=1e-8, max_iters=10000)],
}


def main():
    golden = []
    for problem in problems():
        optima = {}
        for solver, tries in SETTINGS.items():
            for settings in tries:
                posed = pose(**problem)
                try:
                    posed.solve(solver=solver, **settings)
                except (cp.error.SolverError, ArithmeticError, ValueError):
                    continue
                if posed.status == "optimal":  # inaccurate answers are no reference
                    optima[solver] = float(posed.value)
                    break
            if len(optima) == 2:
                break
        values = list(optima.values())
        agree = len(values) == 2 and abs(values[0] / values[1] - 1) < AGREEMENT
        print("kept   " if agree else "LEFT OUT", problem["name"], optima, file=sys.stderr, flush=True)
        if not agree:
            continue
        golden.append({
            "name": problem["name"],
            "a": [a.tolist() for a, _ in problem["vertices"]],
            "b": [b.tolist() for _, b in problem["vertices"]],
            "q": None if problem["q"] is None else problem["q"].tolist(),
            "r": None if problem["r"] is None else problem["r"].tolist(),
            "rates": problem["rates"],
            "sigma": problem["bounds"] and problem["bounds"][0],
            "gamma": problem["bounds"] and problem["bounds"][1],
            "high_gain": problem["high_gain"],
            "objective": problem["objective"],
            "optima": optima,
        })
    versions = {name: version(name) for name in ["cvxpy", "clarabel", "cvxopt", "scs"]}
    json.dump({"versions": versions, "problems": golden}, sys.stdout)


if __name__ == "__main__":
    main()
