#!/usr/bin/env python3
"""Edits proof records and shows that the checker refuses every one: `edits.py RECORD=DESIGN …`.

Every edit has its digest computed again, so that what refuses it is what it says. Half of them change one number
somewhere, of the design by its last bit; these are checked beside the file of the design, as users are told to. The
other half are forgeries, checked without that file: numbers that agree with each other and that the cells do not
prove, a cell that is missing, a gap, an exchanged premise, a dropped claim. (An edit that leaves a true statement that
the record still proves, such as a larger bound of the cost, is no forgery and is not among them.) Last, one number is
changed and the digest is not.
"""
import collections
import hashlib
import json
import math
import multiprocessing
import os
import random
import sys
import tempfile

import check

EDITS = 200


class Unfit(Exception):
    """The edit is of something that this record does not have."""


def parse(path):
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def dump(lines):
    body = "".join(json.dumps(line, separators=(",", ":"), sort_keys=True) + "\n" for line in lines[1:])
    head = {**lines[0], "lines": len(lines) - 1, "sha256": hashlib.sha256(body.encode()).hexdigest()}
    return json.dumps(head) + "\n" + body


def scaled(text, factor):
    return (float.fromhex(text) * factor).hex()


def next_up(text):
    return math.nextafter(float.fromhex(text), math.inf).hex()


def numbers(value):
    """Every place of a number, as (container, key)."""
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(item, (dict, list)):
            yield from numbers(item)
        elif isinstance(item, str) and item.lstrip("-").startswith("0x"):
            yield value, key


def pick(rng, items):
    items = list(items)
    if not items:
        raise Unfit
    return rng.choice(items)


def claims(lines, *kinds):
    return [line for line in lines if "claim" in line and (not kinds or line["kind"] in kinds)]


def designs(lines):
    return [line for line in lines if "plant" in line]


def group(rng, lines, least=1):
    return pick(rng, (g for c in claims(lines) for g in c.get("groups", []) if len(g["cells"]) >= least))


def off_diagonal(rng, rows):
    i, j = rng.sample(range(len(rows)), 2)
    rows[i][j] = next_up(rows[i][j])


# ---- one edit each, of the lines of a record ----


def missing_cell(rng, lines):
    cells = group(rng, lines, 2)["cells"]
    del cells[rng.randrange(len(cells))]


def missing_cells_of_a_piece(rng, lines):
    groups = pick(rng, (c["groups"] for c in claims(lines) if len(c.get("groups", [])) > 1))
    del groups[rng.randrange(len(groups))]


def gap(rng, lines):
    cell = pick(rng, group(rng, lines, 2)["cells"][1:])
    cell[0] = next_up(cell[0])


def early_end(rng, lines):
    cell = group(rng, lines)["cells"][-1]
    cell[1] = math.nextafter(float.fromhex(cell[1]), 0).hex()


def cells_of_another_piece(rng, lines):
    groups = pick(rng, (c["groups"] for c in claims(lines) if len(c.get("groups", [])) > 1))
    first, second = rng.sample(groups, 2)
    first["cells"], second["cells"] = second["cells"], first["cells"]
    if first["piece"] == second["piece"]:
        raise Unfit


def another_premise(rng, lines):
    claim = pick(rng, (c for c in claims(lines) if c["premises"]))
    k = rng.randrange(len(claim["premises"]))
    claim["premises"][k] = pick(rng, set(range(claim["claim"])) - {claim["premises"][k]})


def premises_exchanged(rng, lines):
    premises = pick(rng, (c["premises"] for c in claims(lines) if len(c["premises"]) > 1))
    premises[0], premises[-1] = premises[-1], premises[0]


def dropped_premise(rng, lines):
    del pick(rng, (c["premises"] for c in claims(lines) if c["premises"]))[-1]


def dropped_claim(rng, lines):
    needed = {number for c in claims(lines) for number in c["premises"]}
    gone = pick(rng, needed)
    lines[:] = [line for line in lines if line.get("claim") != gone]
    for claim in claims(lines):
        claim["claim"] -= claim["claim"] > gone
        claim["premises"] = [number - (number > gone) for number in claim["premises"] if number != gone]


def claim_twice(rng, lines):
    lines.append({**pick(rng, claims(lines)), "claim": len(claims(lines))})


def other_level(rng, lines):
    claim = pick(rng, (c for c in claims(lines, "unsaturated", "decrease") if c["level"]))
    claim["level"] = next_up(claim["level"])


def larger_set(rng, lines):
    levels = [c for c in claims(lines, "unsaturated", "decrease", "cost") if c["level"] and c["design"] == 0]
    for claim in levels or pick(rng, []):
        claim["level"] = scaled(claim["level"], 1.2)


def faster(rng, lines):
    claim = pick(rng, (c for c in claims(lines, "cost") if "rate" in c))
    claim["rate"] = scaled(claim["rate"], 100) if float.fromhex(claim["rate"]) else (1.0).hex()


def faster_altogether(rng, lines):
    moving = [c for c in claims(lines, "decrease", "cost") if float.fromhex(c.get("rate", "0x0p+0"))]
    for claim in moving or pick(rng, []):
        claim["rate"] = scaled(claim["rate"], 3)


def cheaper(rng, lines):
    claim = pick(rng, claims(lines, "cost", "sampled-cost"))
    claim["factor"] = scaled(claim["factor"], 0.9)


def sampled_otherwise(rng, lines):
    claim = pick(rng, claims(lines, "sampled", "kept", "sampled-cost"))
    claim["sample_time_s"] = scaled(claim["sample_time_s"], 1.1)


def sampled_slowly(rng, lines):
    design = pick(rng, (d for d in designs(lines) if claims(lines, "sampled")))
    time = scaled(design["sample_time_s"], 1e4)
    for line in [design, *(c for c in claims(lines, "sampled", "kept") if c["design"] == design["design"])]:
        line["sample_time_s"] = time


def other_gain(rng, lines):
    schedule = pick(rng, designs(lines))["controller"]["schedule"]
    container, key = pick(rng, numbers(schedule.get("gains", schedule.get("gain", []))))
    container[key] = scaled(container[key], 1.1) if schedule["kind"] == "vertices" else next_up(container[key])
    if container[key] == (0.0).hex():
        raise Unfit


def other_gain_of_a_point(rng, lines):
    design = pick(rng, (d for d in designs(lines) if d["controller"]["schedule"]["kind"] != "vertices"))
    container, key = pick(rng, numbers(pick(rng, design["points"])["gain"]))
    container[key] = next_up(container[key])


def other_knot(rng, lines):
    point = pick(rng, pick(rng, designs(lines))["points"])
    point["rho"] = (float.fromhex(point["rho"]) + 1e-9).hex()


def weaker_gain_everywhere(rng, lines):
    design = pick(rng, designs(lines))
    scheduled, points = design["controller"]["schedule"].get("gains", []), [p["gain"] for p in design["points"]]
    for container, key in [*numbers(scheduled), *numbers(points)]:
        container[key] = scaled(container[key], -1.0)
    if design["controller"]["schedule"]["kind"] == "constant":
        design["controller"]["schedule"]["gain"] = design["points"][0]["gain"]


def unsymmetric_lyapunov(rng, lines):
    line = lines[1]
    if "plant" not in line:
        return off_diagonal(rng, line["P"] if "P" in line else pick(rng, line["Y"]))
    function = (line.get("rate_bounded") or {}).get("y") or line.get("joined", {}).get("p")
    return off_diagonal(rng, pick(rng, function["coefficients"]) if function else line["points"][0]["p"])


def other_lyapunov_of_a_point(rng, lines):
    point = pick(rng, pick(rng, (d for d in designs(lines) if len(d["points"]) > 1))["points"])
    i = rng.randrange(len(point["p"]))
    point["p"][i][i] = scaled(point["p"][i][i], 1.01)


def other_lyapunov(rng, lines):
    design = pick(rng, (d for d in designs(lines) if d.get("joined")))
    rows = pick(rng, design["joined"]["p"]["coefficients"])
    i = rng.randrange(len(rows))
    rows[i][i] = (float.fromhex(rows[i][i]) + 1e-3).hex()


def harmonic_of_no_point(rng, lines):
    """So small that all is still proved, and of an order that the points cannot tell from a lower one."""
    function = pick(rng, (d for d in designs(lines) if d.get("joined")))["joined"]["p"]
    function["basis"].append({**function["basis"][-1], "harmonic": 40})
    size = len(function["coefficients"][0])
    function["coefficients"].append([[(1e-12 if i == j else 0.0).hex() for j in range(size)] for i in range(size)])


def indefinite_lyapunov(rng, lines):
    line = lines[1]
    if "plant" in line:
        raise Unfit
    rows = line["P"] if "P" in line else pick(rng, line["Y"])
    rows[0][0] = scaled(rows[0][0], -1)


def other_weight(rng, lines):
    weights = pick(rng, (line["weights"] for line in lines[1:] if line.get("weights")))
    rows = weights[rng.choice("qr")]
    rows[0][0] = scaled(rows[0][0], -1)


def larger_weight(rng, lines):
    weights = pick(rng, (line["weights"] for line in lines[1:] if line.get("weights")))
    weights["q"][0][0] = scaled(weights["q"][0][0], 100)


def other_plant(rng, lines):
    plant = pick(rng, (d["plant"] for d in designs(lines) if d["plant"]["name"] == "quadrotor"))
    plant["mass_kg"] = next_up(plant["mass_kg"])


def slimmer_plant(rng, lines):
    plant = pick(rng, (d["plant"] for d in designs(lines) if d["plant"]["name"] == "quadrotor"))
    plant["arm_length_m"] = scaled(plant["arm_length_m"], -1)


def other_vertex(rng, lines):
    line = pick(rng, (line for line in lines[1:] if "polytope" in line))
    line["A"][0][0][0] = (9.0).hex()


def other_weight_of_the_input(rng, lines):
    line = pick(rng, (line for line in lines[1:] if "polytope" in line))
    line["B"][0][-1 if len(line["B"][0]) < 3 else 2][0] = (-1.0).hex()


def less_room(rng, lines):
    of = lambda line: line["controller"]["limits"]["max"] if "plant" in line else line.get("sigma") or [None]
    line = pick(rng, (line for line in lines[1:] if "claim" not in line and of(line)[0]))
    rest = float.fromhex(line["controller"]["operating_input"][0]) if "plant" in line else 0.0
    of(line)[0] = (0.5 * (float.fromhex(of(line)[0]) + rest)).hex()


def cell_of_sampled(rng, lines):
    return pick(rng, pick(rng, pick(rng, (c for c in claims(lines, "sampled") if c["groups"]))["groups"])["cells"])


def unsymmetric_sampled(rng, lines):
    off_diagonal(rng, cell_of_sampled(rng, lines)[2])


def indefinite_sampled(rng, lines):
    x = cell_of_sampled(rng, lines)[2]
    i = rng.randrange(len(x))
    x[i][i] = scaled(x[i][i], -1)


def kept_by_another_claim(rng, lines):
    claim = pick(rng, (c for c in claims(lines, "sampled") if c["premises"]))
    claim["premises"] = [pick(rng, (c["claim"] for c in claims(lines, "decrease") if c["claim"] < claim["claim"]))]


def kept_without_cells(rng, lines):
    claim = pick(rng, (c for c in claims(lines, "sampled") if c["premises"]))
    claim["premises"] = []


def kept_on_a_larger_set(rng, lines):
    claim = pick(rng, claims(lines, "kept"))
    claim["level"] = scaled(claim["level"], 1.01)


def weight_of_a_row(rng, lines):
    """cᵢ that is not positive, or so large that its cell proves nothing."""
    cells = (cell for c in claims(lines, "kept") for g in c["groups"] for cell in g["cells"] if cell[2])
    weights = pick(rng, cells)[2]
    weights[0] = scaled(weights[0], rng.choice([-1.0, 1e9]))


def lower_gain_beyond_the_limits(rng, lines):
    """F, everywhere: nothing but the unsaturated set and the mixtures with K see it."""
    line = pick(rng, (d for d in designs(lines) if d["points"][0].get("auxiliary_gain")))
    moving = line.get("rate_bounded")
    given = [moving["l"]] if moving else [line["joined"]["auxiliary"]] if line.get("joined") else []
    for container, key in [*numbers(given), *numbers([p["auxiliary_gain"] for p in line["points"]])]:
        container[key] = scaled(container[key], 3.0)


def mixtures_missing(rng, lines):
    groups = (g for c in claims(lines, "decrease", "cost", "sampled-cost") for g in c.get("groups", []))
    mixture = pick(rng, (g for g in groups if isinstance(g["variant"], list)))
    mixture["variant"] = [] if mixture["variant"] else [0]


def sampled_cost_alone(rng, lines):
    """The claim about the cost of the sampled loop, and those that it rests on: nothing else sees the edit."""
    claim = pick(rng, claims(lines, "sampled-cost"))
    kept = [*claim["premises"], claim["claim"]]
    lines[:] = [line for line in lines if line.get("claim", kept[0]) in kept]
    for line in claims(lines):
        line["claim"] = kept.index(line["claim"])
        line["premises"] = [kept.index(number) for number in line["premises"]]
    return claim


def sampled_cheaper(rng, lines):
    claim = sampled_cost_alone(rng, lines)
    claim["factor"] = scaled(claim["factor"], 1 - 1e-6)


def sampled_cost_at_another_time(rng, lines):
    time = scaled(sampled_cost_alone(rng, lines)["sample_time_s"], 10.0)
    for line in [*designs(lines), *claims(lines, "sampled-cost")]:
        line["sample_time_s"] = time


def sampled_cost_by_another_lyapunov(rng, lines):
    sampled_cost_alone(rng, lines)
    rows = pick(rng, designs(lines))["points"][0]["p"]
    i = rng.randrange(len(rows))
    rows[i][i] = scaled(rows[i][i], 1.01)  # the set is smaller, so that it does not saturate


def sampled_cost_of_a_larger_set(rng, lines):
    claim = sampled_cost_alone(rng, lines)
    claim["level"] = next_up(claim["level"])


def sampled_cost_on_other_premises(rng, lines):
    sampled_cost_alone(rng, lines)["premises"].reverse()


def sampled_cost_without_a_mixture(rng, lines):
    groups = sampled_cost_alone(rng, lines)["groups"]
    del groups[rng.randrange(len(groups))]


def sampled_cost_of_a_mixture_twice(rng, lines):
    groups = sampled_cost_alone(rng, lines)["groups"]
    first, second = rng.sample(range(len(groups)), 2)
    groups[first] = groups[second]


def governor_of(rng, lines):
    supervisors = (d["controller"].get("supervisor") for d in designs(lines))
    return pick(rng, (s for s in supervisors if s and s.get("governor")))["governor"]


def other_motion(rng, lines):
    functions = governor_of(rng, lines)["motion"][rng.choice(["states", "inputs"])]
    places = [(c, k) for f in functions for c, k in numbers(f["coefficients"]) if abs(float.fromhex(c[k])) > 1e-3]
    container, key = pick(rng, places)
    container[key] = scaled(container[key], 1.001)


def other_flow(rng, lines):
    container, key = pick(rng, numbers(governor_of(rng, lines)["motion"]["parameter_flow"]["coefficients"]))
    container[key] = (0.5 + float.fromhex(container[key])).hex()


def more_authority(rng, lines):
    budget = governor_of(rng, lines)["motion"]["input_budget"]
    budget[0] = scaled(budget[0], 1.01)


def wider_sets(rng, lines):
    bound = pick(rng, pick(rng, claims(lines, "motion"))["bounds"])
    key = rng.choice("qy")
    bound[key] = scaled(bound[key], 10)


def other_inner_gain(rng, lines):
    supervisors = (d["controller"].get("supervisor") for d in designs(lines))
    inner = pick(rng, (m for s in supervisors if s for m in s["inner"]))
    container, key = pick(rng, numbers(inner["schedule"]["gains"]))
    container[key] = next_up(container[key])


FORGERIES = [
    missing_cell, missing_cells_of_a_piece, gap, early_end, cells_of_another_piece, another_premise,
    premises_exchanged, dropped_premise, dropped_claim, claim_twice, other_level, larger_set, faster,
    faster_altogether, cheaper, sampled_otherwise, sampled_slowly, other_gain, other_gain_of_a_point, other_knot,
    weaker_gain_everywhere, unsymmetric_lyapunov, other_lyapunov_of_a_point, other_lyapunov, indefinite_lyapunov,
    harmonic_of_no_point, other_weight, larger_weight, other_plant, slimmer_plant, other_vertex,
    other_weight_of_the_input, less_room, unsymmetric_sampled, indefinite_sampled, kept_by_another_claim,
    kept_without_cells, kept_on_a_larger_set, weight_of_a_row, lower_gain_beyond_the_limits, mixtures_missing,
    other_motion, other_flow, more_authority, wider_sets, other_inner_gain, sampled_cheaper,
    sampled_cost_at_another_time, sampled_cost_by_another_lyapunov, sampled_cost_of_a_larger_set,
    sampled_cost_on_other_premises, sampled_cost_without_a_mixture, sampled_cost_of_a_mixture_twice,
]  # fmt: skip


def places(value, path=()):
    """Every place of a number, as (container, key, keys from the line on)."""
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(item, (dict, list)):
            yield from places(item, (*path, key))
        elif isinstance(item, str) and item.lstrip("-").startswith("0x"):
            yield value, key, (*path, key)


def one_number(rng, lines):
    """The last bit of a number; more of what a claim says or a cell guesses, where a bit more may well be proved."""
    line = pick(rng, [line for line in lines[1:] if any(places(line))])
    container, key, path = pick(rng, places(line))
    number = float.fromhex(container[key])
    if "claim" not in line:
        # what was joined from the points is compared with them, up to rounding
        container[key] = (number + 1.0).hex() if path[0] == "joined" else next_up(container[key])
    elif path[0] == "groups" and isinstance(path[4], int) and path[4] >= 2:
        # cᵢ > 0, or an entry of X
        is_weight = len(path) == 6
        container[key] = (-number).hex() if is_weight or path[5] == path[6] else next_up(container[key])
    elif path[0] in ("groups", "level", "sample_time_s"):
        container[key] = next_up(container[key])
    else:
        container[key] = {
            "rate": (1e4 * number + 1e3).hex(), "factor": (0.5 * number).hex(), "farthest": (1e9).hex(),
        }.get(path[0], (1e3 * number).hex())  # fmt: skip
    return f"one number, {line.get('kind', 'of a design')}: {path[0]}"


def edited(rng, paths):
    """Edits as (name, record, design's file or none, text)."""
    texts = {path: json.dumps(parse(path)) for path in paths}
    records = list(paths)
    for k in range(EDITS // 2):
        path = records[k % len(records)]
        lines = json.loads(texts[path])
        name = one_number(rng, lines)
        yield name, path, paths[path], dump(lines)
    for k in range(EDITS - EDITS // 2):  # each of the forgeries, of one record after the other
        forgery, start = FORGERIES[k % len(FORGERIES)], k + k // len(FORGERIES)
        for path in records[start % len(records) :] + records[: start % len(records)]:
            lines = json.loads(texts[path])
            try:
                forgery(rng, lines)
            except Unfit:
                continue
            yield forgery.__name__.replace("_", " "), path, None, dump(lines)
            break
        else:
            raise SystemExit(f"no record has what {forgery.__name__} changes")


def refusal(edit):
    """Why an edit is refused; nothing if it is not."""
    name, path, design, text = edit
    with tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".jsonl") as file:
        file.write(text)
        file.flush()
        try:
            check.check(file.name, design)
        except Exception as error:
            return name, os.path.basename(path), f"{error}" if isinstance(error, check.Refused) else repr(error)
    return name, os.path.basename(path), ""


def main():
    paths = dict(argument.rsplit("=", 1) for argument in sys.argv[1:])
    edits = list(edited(random.Random(1), paths))
    with multiprocessing.get_context("fork").Pool() as pool:
        refusals = list(pool.imap_unordered(refusal, edits))
    for name, path, why in sorted(refusals):
        if not why or os.environ.get("EDITS") == "-v":
            print(f"{'refused' if why else 'ACCEPTED'}: {path}: {name}: {why}")
    proofs = sum("is not proved" in why for *_, why in refusals)
    reasons = collections.Counter(why.split(": ")[-1] for *_, why in refusals if why and "is not proved" not in why)
    # none rests on the digest: each was computed again
    if any("digest" in why for why in reasons):
        raise SystemExit("an edit was refused for its digest")
    with open(next(iter(paths)), encoding="utf-8") as file:
        kept = file.read().replace('"premises":[0]', '"premises":[ 0]', 1)
    with tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".jsonl") as file:
        file.write(kept)
        file.flush()
        _, _, why = refusal(("digest kept", file.name, None, kept))
    refused = sum(bool(why) for *_, why in refusals)
    why_not = f"{proofs} because cells do not prove them, the others for {len(reasons)} reasons"
    print(f"{refused} of {len(refusals)} refused, {why_not}")
    print(f"and one whose digest is not its own: {why}")
    return 0 if refused == len(refusals) == EDITS and "digest" in why else 1


if __name__ == "__main__":
    sys.exit(main())
