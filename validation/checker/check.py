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
every claim holds. Here the file is read and claims are checked; `functions.py` has the sums and their definiteness,
`designs.py` the plants, the closed loops and the matrices of the theorems.
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

from flint import arb, arb_mat

from designs import Design, Polytope, semidefinite, symmetric
from functions import Refused, Sum, function, is_definite, require

FORMAT = "lpv proof record 1"


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


def check_premises(claims, claim, design):
    """Whether a claim rests on earlier claims of the right kind, about the same design, level and rate."""
    kind, premises = claim["kind"], [claims[number] for number in claim["premises"]]
    require(sum((c["design"], c["kind"]) == (claim["design"], kind) for c in claims) == 1, "two claims are of one kind")
    limited = kind not in ("definite", "sampled") and bool(design.limited)
    falls = ["definite", "unsaturated"] if limited else ["definite"]
    needed = {"definite": [], "sampled": [], "unsaturated": ["definite"], "decrease": falls}
    # what V falls under for every v between Fx and Kx, it falls under for v = Kx
    needed |= {"cost": [*falls, "decrease"], "kept": falls, "sampled-cost": falls, "sampled": ["kept"] if premises else []}
    require([premise["kind"] for premise in premises] == needed[kind], "it does not rest on what it has to")
    require(all(premise["design"] == claim["design"] for premise in premises), "a premise is of another design")
    if kind not in ("definite", "sampled"):
        require(claim["level"] > 0 if limited else claim["level"] is None, "it needs a level, or none")
        require(all(p["level"] == claim["level"] for p in premises[1:]), "a premise is about another level")
    require(kind not in ("cost", "sampled-cost") or claim["factor"] > 0, "the factor is not positive")
    if kind in ("decrease", "cost") and isinstance(design, Design):
        require(design.parameter is not None or claim["rate"] == 0, "there is no parameter that moves")
        require(claim["rate"] >= 0 and (kind != "cost" or premises[-1]["rate"] >= claim["rate"]), "the rate is wrong")
    is_sampled = kind in ("sampled", "kept", "sampled-cost")
    require(not is_sampled or claim["sample_time_s"] == design.line["sample_time_s"] > 0, "the sample time is wrong")


def check_cells(design, claim):
    """Whether the cells of every variant cover the range without gaps."""
    groups, variants = claim["groups"], design.limited if claim["kind"] == "unsaturated" else [None]
    if claim["kind"] == "sampled" and claim["premises"]:
        return require(not groups, "cells are of no use beside a premise")
    if claim["kind"] in ("decrease", "cost", "sampled-cost") and design.saturating:
        chosen = itertools.product((False, True), repeat=len(design.saturating))
        all_rows = [list(itertools.compress(design.saturating, bits)) for bits in chosen]
        by_rows = claim["kind"] != "sampled-cost" and groups[0]["variant"] == "rows"
        variants = ["rows"] if by_rows else all_rows
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
    if kind == "sampled-cost":
        m = design.sampled_cost(variant, claim["sample_time_s"], claim["factor"])
        return is_definite(m.entries(), m.nrows())
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
        "sampled-cost": f"the cost of the saturated loop sampled at T = {claim.get('sample_time_s')!r} s is at most "
        f"{claim.get('factor')!r} V(x(0)){on}",
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
