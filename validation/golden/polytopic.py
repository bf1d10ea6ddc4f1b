#!/usr/bin/env python3
"""Optima of synthesis problems over polytopes, by solvers that share nothing with ours.

The inequalities of Theorems 4.3, 4.4, 5.1 and 5.3 are written here again, with cvxpy, and solved by Clarabel and by SCS or
CVXOPT where installed. The result is the file that the tests of the library read:

    pip install cvxpy clarabel cvxopt
    python3 polytopic.py > ../../crates/lpv/tests/it/data/polytopic.json

Models outside the thesis: two masses and a spring of uncertain stiffness with an actuator of uncertain strength
(Wie and Bernstein, "Benchmark problems for robust control design", 1992), the translational oscillator with rotational
actuator (Bupp, Bernstein and Coppola, "A benchmark problem for nonlinear control design", 1998) between four vertices, a
chain of two saturated inputs, the pendulum of the thesis, and lateral motion of a hovering vehicle over an arc of yaw.
"""

import itertools
import json
import sys

import cvxpy as cp
import numpy as np


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


def chain():
    a = np.diag([1.0, 1.0], 1)
    a[2, 0] = -0.5
    return a, np.array([[0, 0.3], [1, 0], [0, 1]])


def problems():
    pendulum = [(np.array([[0, 1], [1, -0.1]]), np.array([[0.0], [1]])), (np.array([[0, 1], [0, -0.1]]), np.array([[0.0], [1]]))]
    masses = [two_masses(k, strength) for k, strength in [(0.5, 1.0), (2.0, 0.8), (1.0, 1.3)]]
    oscillator = [tora(c, s) for c, s in itertools.product([0.8, 1.0], [-0.2, 0.2])]
    yaw = [arc(psi) for psi in np.linspace(-0.5, 0.5, 3)]
    nu = 0.43618182 * 2
    rates3 = [[1, -1, 0], [-1, 1, 0], [0, 1, -1], [0, -1, 1], [1, 0, -1], [-1, 0, 1]]
    yield "pendulum, common", pendulum, [4, 4], [1], None, None
    yield "pendulum, rate 2", pendulum, [4, 4], [1], [[nu, -nu], [-nu, nu]], None
    yield "two masses, common", masses, [1, 1, 0.1, 0.1], [1], None, None
    yield "two masses, rates", masses, [1, 1, 0.1, 0.1], [1], [[0.2 * v for v in row] for row in rates3], None
    yield "two masses, saturated", masses, [1, 1, 0.1, 0.1], [1], None, ([1.5], 4.0)
    yield "oscillator, common", oscillator, [1, 1, 1, 1], [0.5], None, None
    yield "chain of two inputs, saturated", [chain()], [1, 2, 3], [0.1, 0.2], None, ([1.0, 0.5], 10.0)
    yield "arc of yaw, common", yaw, [1, 1, 0.5, 0.5, 1, 1, 0.1, 0.1], [0.1, 0.1], None, None


def solve(vertices, q, r, rates, bounds, solver):
    """max sum tr Y_i; the same blocks as printed in the thesis, with the corrections of signs and factors."""
    n, m, count = vertices[0][0].shape[0], vertices[0][1].shape[1], len(vertices)
    common = rates is None
    shared = cp.Variable((n, n), symmetric=True)
    ys = [shared] * count if common else [cp.Variable((n, n), symmetric=True) for _ in range(count)]
    ls = [cp.Variable((m, n)) for _ in range(count)]
    qi, ri = np.diag(1 / np.array(q, float)), np.diag(1 / np.array(r, float))
    constraints = []
    for nu in [None] if common else rates:
        rate = 0 if common else sum(nu[i] * ys[i] for i in range(count))
        for i, j in itertools.combinations_with_replacement(range(count), 2):
            def flow(i, j):
                return vertices[i][0] @ ys[j] - vertices[i][1] @ ls[j]
            f = flow(i, i) if i == j else flow(i, j) + flow(j, i)
            y, l, w = (ys[i], ls[i], 1) if i == j else (ys[i] + ys[j], ls[i] + ls[j], 2)
            zero = np.zeros((n, m))
            block = cp.bmat([[w * rate - f - f.T, y, l.T], [y, w * qi, zero], [l, zero.T, w * ri]])
            constraints.append((block + block.T) / 2 >> 0)
    for y in ys[:1] if common else ys:
        constraints.append(y >> 0)
    if bounds:
        sigma, gamma = bounds
        for y, l in zip(ys, ls):
            for i in range(m):
                row = cp.reshape(l[i, :], (1, n), order="C")
                block = cp.bmat([[np.array([[sigma[i] ** 2 / gamma]]), row], [row.T, y]])
                constraints.append((block + block.T) / 2 >> 0)
    objective = cp.trace(shared) if common else sum(cp.trace(y) for y in ys)
    problem = cp.Problem(cp.Maximize(objective), constraints)
    settings = {
        "CLARABEL": dict(tol_gap_abs=1e-8, tol_gap_rel=1e-8, tol_feas=1e-9),
        "CVXOPT": dict(abstol=1e-9, reltol=1e-9, feastol=1e-9),
        "SCS": dict(eps_abs=1e-9, eps_rel=1e-9, max_iters=200000),
    }[solver]
    problem.solve(solver=solver, **settings)
    return problem.value if problem.status == "optimal" else None


def main():
    installed = [name for name in ["CLARABEL", "CVXOPT", "SCS"] if name in cp.installed_solvers()]
    golden = []
    for name, vertices, q, r, rates, bounds in problems():
        optima = {}
        for solver in installed:
            try:
                optimum = solve(vertices, q, r, rates, bounds, solver)
                if optimum is not None:  # inaccurate answers are no reference
                    optima[solver] = float(optimum)
            except cp.error.SolverError as error:
                print(f"{name}: {solver}: {error}", file=sys.stderr)
            if len(optima) == 2:
                break
        print(name, optima, file=sys.stderr)
        golden.append({
            "name": name,
            "a": [a.tolist() for a, _ in vertices],
            "b": [b.tolist() for _, b in vertices],
            "q": q,
            "r": r,
            "rates": rates,
            "sigma": bounds and bounds[0],
            "gamma": bounds and bounds[1],
            "optima": optima,
        })
    json.dump(golden, sys.stdout)


if __name__ == "__main__":
    main()
