// What a claim is worth: the system it is about, its set and rate, what it rests on, what it does not cover, and what
// breaks it. A claim is a line with its verdict, which opens the rest; what it rests on are such lines again.

import { verdictButton, verdictChip } from "./badge";
import type { Claim, Motion, Report, Run, Verdict, Witness } from "./data";
import { commandLine, disclose } from "./disclosure";
import { el } from "./dom";
import { about, atLeast, atMost, rateText, symbol, symbolText } from "./format";

/** Claims about a flight; the others are about the design, whatever it flies. */
const OF_FLIGHT: readonly string[] = ["step-cost", "step-stays", "rate-kept"];
/** Claims about matrices at each parameter: no motion is in them. */
const OF_MATRICES: readonly string[] = ["weights", "lyapunov-definite"];
/** Claims about the loop as it is sampled. */
const OF_SAMPLES: readonly string[] = ["sampled-stability", "sampled-invariance", "sampled-cost"];
/** What was asked for, and whether anything can be proved: no statement about a loop. */
const OF_THE_PROOF: readonly string[] = ["as-asked", "provable"];

/** The Lyapunov function, as it is written on the page. */
export const LYAPUNOV = "xᵀPx";

/** What its panels need to know beyond the claim. */
export interface Context {
  report: Report;
  run: Run;
  /** Whether the panel stands in one that has the command already. */
  hasCommand?: boolean;
}

/** The panel of a run: the claim that decides its verdict, those that nothing else rests on, and how to prove them again. */
export function runEvidence(context: Context): HTMLElement {
  const { run } = context;
  const within = { ...context, hasCommand: true };
  const premises = new Set(run.claims.flatMap((claim) => claim.premises));
  const flight = run.claims.filter(isOfFlight);
  const deciding = decidingClaim(run, premises);
  // it leads, even where others rest on it
  const design = [...(deciding && premises.has(deciding.id) ? [deciding] : []), ...run.claims.filter((claim) => !isOfFlight(claim) && !premises.has(claim.id))];
  const list = (title: string, claims: Claim[]): HTMLElement[] =>
    claims.length === 0 ? [] : [el("h4", {}, title), claimList(within, claims, [], deciding)];
  return el(
    "div",
    { class: "evidence", role: "region", "aria-label": `What ${run.label} rests on` },
    el("p", { class: "evidence-verdict" }, designSentence(run)),
    ...list("Claims about the design", design),
    ...list("Claims about this flight", flight),
    ...proofAgain(run),
  );
}

/** Of the claims with the verdict of the design the one on which nothing rests, and of these the one that rests on most. */
function decidingClaim(run: Run, premises: Set<string>): Claim | undefined {
  const isRoot = (claim: Claim): number => (premises.has(claim.id) ? 0 : 1);
  const candidates = run.claims.filter((claim) => !isOfFlight(claim) && claim.verdict === run.verdict);
  return candidates.sort((a, b) => isRoot(b) - isRoot(a) || b.premises.length - a.premises.length)[0];
}

const WORST: Record<Verdict, string> = {
  proved: "every claim about it is proved",
  numerical: "its weakest claim holds at the points checked, and is not proved",
  undecided: "a claim about it could not be decided",
  refuted: "a claim about it is false",
};

function designSentence(run: Run): string {
  const count = run.claims.filter((claim) => !isOfFlight(claim)).length;
  if (count === 0) return "Nothing was checked about this design.";
  return `The design is ${run.verdict}: ${WORST[run.verdict]}.`;
}

function isOfFlight(claim: Claim): boolean {
  return OF_FLIGHT.includes(claim.kind);
}

function proofAgain(run: Run): HTMLElement[] {
  if (run.certify_command === "") return [];
  return [el("h4", {}, run.verdict === "proved" ? "Prove it again" : "Check it again, and prove what can be proved"), commandLine(run.certify_command)];
}

/** Claims, a line each; `path` are those that lead here, `first` is open at first. */
export function claimList(context: Context, claims: Claim[], path: Claim[] = [], first?: Claim): HTMLElement {
  return el("ul", { class: "claims" }, ...claims.map((claim) => claimItem(context, claim, path, claim === first)));
}

function claimItem(context: Context, claim: Claim, path: Claim[], open: boolean): HTMLElement {
  const button = verdictButton(claim.verdict, `what it rests on: ${claim.claim}`);
  const text = el("div", {}, el("div", { class: "claim" }, claim.claim), claim.detail !== "" && el("div", { class: "run-sub" }, claim.detail));
  const item = el("li", { "data-claim": claim.id }, button, text);
  const panel = disclose(button, () => claimEvidence(context, claim, path), (panel) => item.append(panel));
  if (open) panel.open();
  return item;
}

/** The panel of one claim. */
function claimEvidence(context: Context, claim: Claim, path: Claim[]): HTMLElement {
  const hasCommand = context.hasCommand || path.length > 0 || isOfFlight(claim);
  return el(
    "div",
    { class: "evidence evidence-claim", role: "region", "aria-label": `What the claim rests on: ${claim.claim}` },
    el("dl", { class: "evidence-facts" }, ...facts(context.report, claim).map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value)))),
    ...(claim.witness ? witnessTable(context.report, claim.witness) : []),
    el("h4", {}, "Rests on"),
    premiseList(context, claim, path),
    ...uncoveredList(context, claim),
    ...(hasCommand ? [] : proofAgain(context.run)),
  );
}

function premiseList(context: Context, claim: Claim, path: Claim[]): HTMLElement {
  if (claim.premises.length === 0) return el("p", { class: "muted" }, isOfFlight(claim) ? "The claims about the design, and what this flight did." : "No other claim.");
  const list = el("ul", { class: "claims premises" });
  for (const id of claim.premises) {
    const premise = context.run.claims.find((other) => other.id === id);
    // no claim rests on itself, whatever the data say
    const isOpenable = premise !== undefined && premise !== claim && !path.includes(premise);
    list.append(isOpenable ? claimItem(context, premise, [...path, claim], false) : plainItem(id, premise));
  }
  return list;
}

/** A premise that opens nothing. */
function plainItem(id: string, premise: Claim | undefined): HTMLElement {
  const text = premise?.claim ?? `${id}, of which nothing is known`;
  return el("li", { "data-claim": id }, verdictChip(premise?.verdict ?? "undecided"), el("div", { class: "claim" }, text));
}

/** The system, set, rate and margin of a claim. */
function facts(report: Report, claim: Claim): [string, Node | string][] {
  const { parameter } = report.scheduling;
  const list: [string, Node | string][] = [["About", system(report, claim)]];
  if (typeof claim.level === "number") list.push(["Set", `${LYAPUNOV} ≤ ${atLeast(claim.level)}`]);
  else if (claim.level === null) list.push(["Set", "all states"]);
  if (claim.motion) list.push(...motionFact(report, claim.motion));
  if (typeof claim.factor === "number") list.push(["Cost", `at most ${atMost(claim.factor)} ${LYAPUNOV} at the start`]);
  if (typeof claim.bound === "number") list.push(["Cost", `at most ${atMost(claim.bound)}`]);
  if (typeof claim.sample_time_s === "number") list.push(["Sample time", `${about(claim.sample_time_s)} s`]);
  // what a witness proves is how far below zero it is
  if (claim.margin !== null) list.push(["Margin", claim.verdict === "refuted" ? atMost(claim.margin) : atLeast(claim.margin)]);
  else if (claim.verdict === "undecided" && !OF_THE_PROOF.includes(claim.kind)) list.push(["Margin", "not known"]);
  if (claim.at !== null && parameter !== "") list.push(["At", `${symbolText(parameter)} = ${about(claim.at)} ${report.scheduling.unit}`]);
  if (claim.cells > 0) list.push(["Proof", `${claim.cells} ${claim.cells === 1 ? "cell" : "cells"} of ${parameter === "" ? "the model" : `the range of ${symbolText(parameter)}`}`]);
  return list;
}

function system(report: Report, claim: Claim): string {
  if (claim.premises.includes("sampled-cost")) return "this flight of the plant, sampled and saturated";
  if (isOfFlight(claim)) return claim.of === "plant" ? "this flight of the plant, in continuous time" : `this flight, by the ${report.plant.linear ? "loop in continuous time" : "LPV model"}`;
  if (claim.kind === "weights") return "the weights of the cost";
  if (claim.of === "plant") return "the nonlinear plant";
  return report.plant.linear ? "the plant, which is linear" : "the LPV model of the nonlinear plant";
}

function motionFact(report: Report, motion: Motion): [string, string][] {
  const { parameter, unit } = report.scheduling;
  switch (motion.motion) {
    case "none":
      return [];
    case "at-rest":
      return [["Rate", `${symbolText(parameter)} at rest, at any value`]];
    case "bounded":
      return [["Rate", `${rateText(parameter)} ≤ ${atLeast(motion.rate)} ${unit}/s`]];
    case "hull":
      return [["Rate", "in the hull of the rate vertices"]];
    case "any":
      return [["Rate", "any"]];
  }
}

function uncoveredList(context: Context, claim: Claim): HTMLElement[] {
  // what is false covers nothing
  if (claim.verdict === "refuted") return [];
  const gaps = uncovered(context, claim);
  const list =
    gaps.length === 0
      ? el("p", { class: "muted" }, "Nothing is left out: it is a statement about matrices alone.")
      : el("ul", { class: "uncovered" }, ...gaps.map((gap) => el("li", {}, gap)));
  return [el("h4", {}, claim.verdict === "undecided" ? "Even if it were proved, it would not cover" : "Does not cover"), list];
}

/** What a reader might take to be covered, and is not. */
function uncovered(context: Context, claim: Claim): string[] {
  const { kind } = claim;
  const checked = claim.verdict === "numerical" ? ["What lies between the points checked, and the rounding of the check."] : [];
  if (OF_MATRICES.includes(kind)) return checked;
  if (OF_THE_PROOF.includes(kind)) return [...checked, "What the loop does: it compares what was asked for with what is proved."];
  if (isOfFlight(claim)) checked.push("Other flights: other starts, set points or seeds.");
  if (kind === "rate-kept") return checked;
  const isLinearised = claim.of === "model" && !context.report.plant.linear;
  if (isLinearised) checked.push("What linearisation leaves out: the plant is nonlinear, the claim is about its LPV model.");
  return [...checked, ...conditions(context.report, claim), ...(kind === "unsaturated" ? [] : surroundings(context, claim))];
}

/** Motions of the parameter and states that the claim is not for. */
function conditions({ scheduling }: Report, claim: Claim): string[] {
  const { kind, motion } = claim;
  const name = symbolText(scheduling.parameter);
  const isFixed = motion?.motion === "at-rest" || (scheduling.parameter !== "" && [...OF_SAMPLES, "frozen-stability"].includes(kind));
  const gaps: string[] = [];
  if (motion?.motion === "bounded") gaps.push(`${name} moving faster than ${atLeast(motion.rate)} ${scheduling.unit}/s.`);
  if (isFixed) gaps.push(`A ${name} that moves.`);
  if (typeof claim.level === "number") gaps.push("Errors that start outside the set, or are pushed out of it.");
  if (kind === "sampled-stability" || kind === "frozen-stability") gaps.push("Inputs that saturate.");
  return gaps;
}

/** What the loop has around it, and the claim has not. */
function surroundings({ report, run }: Context, claim: Claim): string[] {
  const hold = `Sampling: the claim is about a controller in continuous time, this one holds its inputs for ${about(report.sample_time_s)} s.`;
  const isSampled = ["sampled-stability", "sampled-cost"].includes(claim.kind) || claim.premises.includes("sampled-cost");
  const between = claim.kind === "sampled-invariance" ? ["The motion between samples."] : isSampled ? [] : [hold];
  const isEstimated = run.estimation !== null || run.measurement !== null;
  return [
    ...between,
    isEstimated ? "Noise, and errors of the estimate that this controller flies on: the state is taken to be known." : "Noise and disturbances; the state is taken to be known.",
    "Delays, and whatever else the plant's equations leave out.",
  ];
}

/** The error whose motion breaks a claim. */
function witnessTable(report: Report, witness: Witness): HTMLElement[] {
  const { states } = report.plant;
  const { parameter, unit } = report.scheduling;
  const number = (value: number | null, unit: string): string => (value === null ? "–" : `${about(value)} ${unit.replace("^2", "²")}`.trim());
  const isState = witness.state.length === states.length;
  const rows = witness.state.map((value, i): [Node | string, string] => {
    const state = isState ? states[i]! : null;
    return state ? [symbol(state.name), number(value, state.unit)] : [`direction ${i + 1}`, number(value, "")];
  });
  const rate = rateText(parameter).replaceAll("|", "");
  const moving = ` at ${symbolText(parameter)} = ${number(witness.parameter, unit)} with ${rate} = ${number(witness.rate, `${unit}/s`)}`;
  const where = parameter === "" ? "" : moving;
  return [el("h4", {}, `Counter-example${where}: ${isState ? "the error of the state" : "the direction"}`), el("dl", { class: "witness" }, ...rows.map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value))))];
}
