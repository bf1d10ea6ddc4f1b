#!/usr/bin/env python3
"""H∞ norms of C(sI − A)⁻¹B for stable plants of COMPleib, to seventeen digits.

A plant that is not stable gets A − shift·I in place of A. The norm is found as Bruinsma and Steinbuch do (Systems & Control Letters 14, 1990):
γ below the norm makes the Hamiltonian matrix [A, BBᵀ/γ²; −CᵀC, −Aᵀ] have eigenvalues on the imaginary axis, and the largest singular value at the middle of
two of them is a better γ; where there is none at γ(1 + 10⁻¹⁸), γ is the norm. All in 600 bits, so that neither the plants whose modes hardly damp nor those with widely
spread units lose digits. The result is the file that the tests read, one plant a line:

    pip install python-flint
    python3 bounded_real.py compleib.json norms.json > ../../crates/lmi/tests/data/bounded-real.json

`compleib.json`: COMPleib 1.1 (F. Leibfritz, 2004), plants as {A, B, C, …}, read from github.com/ackrep-org/ackrep_data. `norms.json`: the plants to take, with shifts.
"""

import json
import sys

from flint import acb, acb_mat, arb, arb_mat, ctx, fmpq

ctx.prec = 600
# What rounding leaves of a real part that is zero, relative to the largest eigenvalue: double eigenvalues have half the digits.
AXIS = arb(2) ** -250
MARGIN = arb(10) ** -18


def middle(x):
    return arb(x.mid())


def eigenvalues(m):
    return m.eig(algorithm="approx")


def gain(a, b, c, w):
    """The largest singular value at the frequency w."""
    n = a.nrows()
    shifted = acb_mat([[acb(0, w if i == j else 0) - a[i, j] for j in range(n)] for i in range(n)])
    g = acb_mat(c) * shifted.solve(acb_mat(b))
    gram = adjoint(g) * g
    size = gram.nrows()
    if size == 1:
        return middle(gram[0, 0].real).sqrt()
    exact_gram = [[acb(middle(gram[i, j].real), middle(gram[i, j].imag)) for j in range(size)] for i in range(size)]
    values = [middle(v.real) for v in eigenvalues(acb_mat(exact_gram))]
    return max(values, key=lambda v: v.mid()).sqrt()


def adjoint(g):
    return acb_mat([[acb(g[i, j].real, -g[i, j].imag) for i in range(g.nrows())] for j in range(g.ncols())])


def crossings(a, b, c, gamma):
    """Frequencies at which a singular value is γ."""
    n = a.nrows()
    bb, cc = b * b.transpose(), c.transpose() * c
    rows = [[a[i, j] for j in range(n)] + [bb[i, j] / gamma**2 for j in range(n)] for i in range(n)]
    rows += [[-cc[i, j] for j in range(n)] + [-a[j, i] for j in range(n)] for i in range(n)]
    values = eigenvalues(acb_mat(acb_mat([[acb(middle(arb(x))) for x in row] for row in rows])))
    size = max(abs(float(v.real.mid())) + abs(float(v.imag.mid())) for v in values)
    on_axis = [v for v in values if abs(middle(v.real)) < AXIS * size]
    return sorted((middle(v.imag) for v in on_axis), key=float)


def norm(a, b, c, start):
    gamma = start
    for _ in range(60):
        found = crossings(a, b, c, gamma * (1 + MARGIN))
        if not found:
            return gamma
        tries = [(u + v) / 2 for u, v in zip(found, found[1:])] + ([found[0]] if len(found) == 1 else [])
        best = max((gain(a, b, c, w) for w in tries), key=lambda g: g.mid())
        if not best > gamma * (1 + MARGIN):
            raise ArithmeticError("no progress")
        gamma = best
    raise ArithmeticError("no end")


def exact(rows):
    return arb_mat([[arb(fmpq(*float(x).as_integer_ratio())) for x in row] for row in rows])


def main():
    plants, wanted = (json.load(open(path)) for path in sys.argv[1:3])
    print("[")
    for index, entry in enumerate(wanted):
        plant = plants[entry["plant"]]
        n = plant["nx"]
        a = [[float(plant["A"][i][j]) - (entry["shift"] if i == j else 0.0) for j in range(n)] for i in range(n)]
        b, c = ([[float(x) for x in row] for row in plant[key]] for key in "BC")
        value = norm(exact(a), exact(b), exact(c), arb(entry["hinf"]) * (1 - arb(10) ** -6))
        digits = value.str(17, radius=False)
        text = json.dumps({"plant": entry["plant"], "norm": float(digits), "A": a, "B": b, "C": c})
        text = text.replace(".0,", ",").replace(".0]", "]")
        print(text + ("," if index + 1 < len(wanted) else ""), flush=True)
        print(entry["plant"], digits, float(digits) / entry["hinf"] - 1, file=sys.stderr, flush=True)
    print("]")


if __name__ == "__main__":
    main()
