#!/usr/bin/env python3
"""Checks a proof record of lpv without lpv: `check.py RECORD [--design DESIGN.json]`.

Everything is derived again from the numbers of the record, in balls of Arb (python-flint) whose radii hold every
rounding, by another method than lpv's:

* Matrices are, on a piece of the parameter's range, sums of constant matrices times t^j cos kρ and t^j sin kρ (`Sum`),
  ρ = low + ω (piece + t): gains are cubic splines in t, plant and Lyapunov matrix trigonometric polynomials in ρ.
* On a cell [a, b], entry by entry, M(t) = chord of M(a), M(b) + e with e in [-(b - a)²/8, 0]·M''(cell) (error of
  interpolation). If a concave function of M(a) + e and of M(b) + e is positive definite, so is that of every M(t).
* A symmetric ball matrix N is positive definite if in TNTᵀ - I every row sums to less than 1 (Gershgorin); T is any
  matrix, here the inverse of a Cholesky factor in floating point. A cell that is too wide for that is halved.

The last line says `accepted` only if every claim holds. Here the file is read and judged; `functions.py` has the sums
and their definiteness, `designs.py` the plants, the closed loops and the matrices of the theorems.
"""
import argparse
import hashlib
import itertools
import json
import math
import sys
from fractions import Fraction

from flint import arb

from designs import Design, Loop, Polytope, semidefinite, symmetric
from functions import Refused, Sum, function, require

FORMAT = "lpv proof record 1"
FALLS = ["definite", "unsaturated"]
# What a claim rests on (on what does not saturate, where an input is limited), what shows it, and its words.
KINDS = {
    "definite": ([], Loop.definite, "the Lyapunov matrix is positive definite"),
    "unsaturated": (["definite"], Loop.unsaturated, "the low gain does not saturate on V <= level"),
    "decrease": (FALLS, Loop.falling, "V decreases on V <= level up to the rate of the parameter"),
    "cost": ([*FALLS, "decrease"], Loop.falling, "the cost is at most factor V(x(0)) from V <= level up to the rate"),
    "kept": (FALLS, Design.kept, "the saturated loop, sampled, stays on V <= level at every fixed parameter"),
    "sampled": ([], Design.sampled, "the loop, sampled, is stable at every fixed parameter"),
    "sampled-cost": (FALLS, Design.sampled_cost, "from V <= level the loop, sampled, costs at most factor V(x(0))"),
    "motion": ([], None, "the reference moves as the model does, each state by up to farthest"),
}
NUMBERS = ("level", "factor", "rate", "sample_time_s", "between", "farthest")


def exact(value):
    """Hexadecimal floating point to floats, in all of a value."""
    if isinstance(value, str) and value.lstrip("-").startswith("0x"):
        number = float.fromhex(value)
        require(math.isfinite(number) and number.hex() == value, f"{value} is not written as it should be")
        return number
    if isinstance(value, list):
        return [exact(item) for item in value]
    return {key: exact(item) for key, item in value.items()} if isinstance(value, dict) else value


def load(text):
    """A line of JSON, in which no key stands twice and numbers are integers or hexadecimal floating point."""
    def no_twins(pairs):
        require(len(dict(pairs)) == len(pairs), "a key stands twice")
        return dict(pairs)
    no_decimals = lambda number: require(False, f"{number} is no exact number")
    return exact(json.loads(text, object_pairs_hook=no_twins, parse_float=no_decimals, parse_constant=no_decimals))


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
        require(line.get("inner_of") in [None, *range(number)], "a design is a member of none that stands before it")
    for number, line in enumerate(claims):
        require(line["claim"] == number and 0 <= line["design"] < len(designs), "claims are not numbered in turn")
        require(all(0 <= premise < number for premise in line["premises"]), "a premise is no earlier claim")
        require(line["kind"] in KINDS, "a claim is of no kind that is known")
    return designs, claims


def check_premises(claims, claim, design):
    """Whether a claim rests on earlier claims of the right kind, about the same design, level and rate."""
    kind, premises = claim["kind"], [claims[number] for number in claim["premises"]]
    require(sum((c["design"], c["kind"]) == (claim["design"], kind) for c in claims) == 1, "two claims are of one kind")
    needed = [name for name in KINDS[kind][0] if name != "unsaturated" or design.limited]
    if kind == "sampled" and premises:  # what V falls under for every v between Fx and Kx, it falls under for v = Kx
        needed = ["kept"]
    require([premise["kind"] for premise in premises] == needed, "it does not rest on what it has to")
    require(all(premise["design"] == claim["design"] for premise in premises), "a premise is of another design")
    if kind not in ("definite", "sampled"):
        require(claim["level"] > 0 if design.limited else claim["level"] is None, "it needs a level, or none")
        require(all(p["level"] == claim["level"] for p in premises[1:]), "a premise is about another level")
    require("cost" not in kind or claim["factor"] > 0, "the factor is not positive")
    if kind in ("decrease", "cost") and not design.vertices:
        require(design.parameter is not None or claim["rate"] == 0, "there is no parameter that moves")
        require(claim["rate"] >= 0 and (kind != "cost" or premises[-1]["rate"] >= claim["rate"]), "the rate is wrong")
    is_sampled = kind in ("sampled", "kept", "sampled-cost")
    require(not is_sampled or claim["sample_time_s"] == design.line["sample_time_s"] > 0, "the sample time is wrong")


def groups_of(claim, design):
    """The groups of a claim, of every variant; their cells cover the range without gaps. A polytope has no cells."""
    kind, variants = claim["kind"], design.variants(claim["kind"])
    if design.vertices:
        return [{"piece": 0, "variant": variant, "cells": [[0.0, 1.0]]} for variant in variants]
    groups = claim["groups"]
    if kind == "sampled" and claim["premises"]:
        require(not groups, "cells are of no use beside a premise")
        return []
    if kind in ("decrease", "cost") and design.saturating and groups[0]["variant"] == "rows":
        variants = ["rows"]
    expected = itertools.product(range(design.pieces), variants)
    found = sorted(str((group["piece"], group["variant"])) for group in groups)
    require(sorted(map(str, expected)) == found, "cells are missing, or stand twice")
    for group in groups:
        cells, piece, has_weights = group["cells"], group["piece"], kind == "kept" or group["variant"] == "rows"
        require(cells and cells[0][0] == piece and cells[-1][1] == piece + 1, "cells do not cover their piece")
        require(all(cell[0] < cell[1] for cell in cells), "a cell is empty")
        require(all(left[1] == right[0] for left, right in zip(cells, cells[1:])), "there is a gap between cells")
        for _, _, *more in cells:
            require(len(more) == (has_weights or kind == "sampled"), "a cell has too little or too much")
            if kind == "sampled":
                symmetric(more[0], design.n, "X")
            is_weight = not has_weights or len(more[0]) == len(design.saturating) and min(more[0], default=1) > 0
            require(is_weight, "a weight of a row is not positive")
    return groups


def check_motion(designs, claims, claim):
    """Whether the reference of a governor moves as the model does, but for a disturbance that the sets absorb.

    x_ref = x₀ + Σ s⁽ᵏ⁾ Z_kΔ and u_ref = Σ s⁽ᵏ⁾ (U_k + ρ̇V_k)Δ leave w = Σ s⁽ᵏ⁺¹⁾ R_kΔ + ρ̇ Σ s⁽ᵏ⁾ S_kΔ,
    R_k = Z_k - AZ_{k+1} - BU_{k+1}, S_k = Z_k′ - BV_k. On V = γ: |2eᵀPw| ≤ 2√γ|w|/√y for Y ⪰ yI, and
    eᵀQe ≥ q|e|² ≥ qyγ for Q ⪰ qI, so that |w| < q y^{3/2} √γ/(2 factor) leaves {V ≤ γ} invariant. Each state moves
    alone, by at most `farthest`, ρ by half a turn.
    """
    outer, premises = designs[claim["design"]], [claims[number] for number in claim["premises"]]
    members = [outer, *(design for design in designs if design.line.get("inner_of") == claim["design"])]
    supervisor, governor = (outer.line["controller"]["supervisor"], outer.line["controller"]["supervisor"]["governor"])
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
    zero = lambda rows: Sum((rows, len(states)))
    of = lambda functions, rows: [function(value, (rows, len(states))) for value in functions]
    place = Sum.constant([[float(i == state) for state in states] for i in range(outer.n)])
    z, u = [place, *of(motion["states"], outer.n), zero(outer.n)], of(motion["inputs"], outer.m)
    v = [*(of(motion["inputs_by_rate"], outer.m) or [zero(outer.m)] * (len(u) - 1)), zero(outer.m)]
    require(len(z) == len(u) + 1 == len(v) + 1, "the chain of the motion is broken")
    require((outer.a @ place).is_zero(), "the plant does not rest wherever it is put")
    if outer.parameter is not None:
        off = function(motion["parameter_flow"], (1, outer.n)) - outer.a.rows([outer.parameter])
        require(all(off.bound(0, j) < 1e-12 for j in range(outer.n)), "the parameter moves otherwise")
    along = [z[k] - outer.a @ z[k + 1] - outer.b @ u[k] for k in range(len(u))]
    across = [z[k + 1].slope(0, 1) - outer.b @ v[k] for k in range(len(u))]
    both = lambda still, moving, i, j: still.bound(i, j) + rate * moving.bound(i, j)
    worst = arb(0)
    for j, state in enumerate(states):
        move = arb.pi() if state == outer.parameter else arb(claim["farthest"])
        # |s⁽ᵏ⁾| ≤ bₖ by the bounds on inputs, states and rate; a profile with lengths T₁ ≥ T₂ ≥ … has
        # |s⁽ᵏ⁾| ≤ pₖ = 1/(T₁⋯Tₖ) ≤ b_m^{k/m}, m ≥ k
        least = []
        for k in range(len(u)):
            used = [(both(u[k], v[k], i, j), motion["input_budget"][i]) for i in range(outer.m)]
            used += [(z[k + 1].bound(i, j), b) for i, b in enumerate(motion["state_bounds"]) if b is not None]
            if k == 0 and state == outer.parameter and governor["parameter_rate"] is not None:
                used.append((arb(1), governor["parameter_rate"]))
            least.append(min((arb(bound) / (size * move) for size, bound in used if size > 0), default=None))
        peak = lambda k: min(least[m] ** (arb(k + 1) / (m + 1)) for m in range(k, len(u)) if least[m] is not None)
        square = arb(0)
        for i in range(outer.n):  # a derivative that nothing bounds has to move nothing
            sizes = [(k, both(along[k], across[k], i, j)) for k in range(len(u))]
            square += sum(peak(k) * size * move for k, size in sizes if not size.is_zero()) ** 2
        worst = worst.max(square.abs_upper().sqrt())
    pairs = list(zip(premises, claim["bounds"], strict=True))
    for premise, bound in pairs:
        q = [[Fraction(x) for x in row] for row in outer.line["weights"]["q"]]
        for i, row in enumerate(q):
            row[i] -= Fraction(bound["q"])
        require(bound["q"] > 0 and bound["y"] > 0 and semidefinite(q, False), "Q is not above its bound")
        root = (arb(bound["y"]) ** 3 * arb(premise["level"])).sqrt()
        absorbed = arb(bound["q"]) * root / (2 * arb(premise["factor"]))
        require(worst < absorbed, f"the sets absorb {absorbed} and have to absorb {worst}")
    return pairs


def statement(claim):
    """The claim in words, with its own numbers."""
    numbers = [f"{key} = {claim[key]!r}" for key in NUMBERS if claim.get(key) is not None]
    return KINDS[claim["kind"]][2] + (f" ({', '.join(numbers)})" if numbers else "")


def lines_of(file, designs):
    """What a design's file says, as the lines of a record."""
    if "model" not in file:
        return [file, *file.get("inner", [])]
    every = lambda x: x if x is None or isinstance(x[0][0], list) else [x]
    given, weights, lines = {**file, **file["model"]}, file.get("weights"), []
    for k, design in enumerate(designs):  # one polytope, or one for each vertex
        vertices = range(k, k + design.vertices) if len(designs) > 1 else range(design.vertices)
        each = {key: every(given.get(key)) for key in "ABKFYLP"}
        line = {key: x and [x[i % len(x)] for i in vertices] for key, x in each.items()}
        line |= {"P": line["P"] and line["P"][0], "weights": weights and {"q": weights["Q"], "r": weights["R"]}}
        lines.append(line | {key: file.get(key) for key in ("sigma", "rate_vertices")})
    return lines


def check_file(designs, path):
    """Whether every number that the record has of a design is the one of the design's file."""
    def same(mine, given):
        if isinstance(mine, dict):
            return isinstance(given, dict) and all(same(value, given.get(key)) for key, value in mine.items())
        if isinstance(mine, list):
            return isinstance(given, list) and len(mine) == len(given) and all(map(same, mine, given))
        return mine == given
    added = ("design", "polytope", "inner_of", "pieces", "joined")
    mine = [{key: value for key, value in design.line.items() if key not in added} for design in designs]
    with open(path, encoding="utf-8") as text:
        require(same(mine, lines_of(json.load(text), designs)), "the file has another design")


def check(path, file=None):
    """The claims of a record, all of which hold; else an exception says what does not."""
    lines, claims = read(path)
    designs, tasks = [Polytope(line) if "polytope" in line else Design(line) for line in lines], []
    if file is not None:
        check_file(designs, file)
    for claim in claims:
        theorem, groups = KINDS[claim["kind"]][1], []
        if claim["kind"] == "motion":
            for premise, bound in check_motion(designs, claims, claim):
                above = {**claims[premise["premises"][0]], "floor": bound["y"]}
                tasks += [(k, Loop.bounded, above, group) for k, group in enumerate(above["groups"])]
        else:
            check_premises(claims, claim, designs[claim["design"]])
            groups = groups_of(claim, designs[claim["design"]])
        tasks += [(k, theorem, claim, group) for k, group in enumerate(groups)]
    # the first cells of each claim before the second: what is false shows early
    for _, theorem, claim, group in sorted(tasks, key=lambda task: task[0]):
        where = f"claim {claim['claim']}, {statement(claim)}, is not proved on piece {group['piece']}"
        require(designs[claim["design"]].shows(theorem, claim, group), where)
    return [statement(claim) for claim in claims]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("record")
    parser.add_argument("--design", help="file of the design that the record has to be about")
    arguments = parser.parse_args()
    try:
        statements = check(arguments.record, arguments.design)
    except Exception as error:  # whatever a record breaks, it is not proved
        print(f"refused: {error if isinstance(error, Refused) else repr(error)}")
        return 1
    print(*(f"holds: {text}" for text in statements), f"accepted: {len(statements)} claims", sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
