// The comparison table: one row per controller. On a narrow screen each row becomes a card.

import { letterBadge, lineSample, VERDICT_MEANING, verdictButton, verdictChip } from "./badge";
import type { Claim, Report, Run, Verdict } from "./data";
import { disclose } from "./disclosure";
import { el } from "./dom";
import { LYAPUNOV, runEvidence } from "./evidence";
import { about, atLeast, atMost, percent, rateText } from "./format";
import type { Selection } from "./selection";
import type { Theme } from "./theme";

/** Heads of the columns beside the one that shows and hides. */
function columns(report: Report): string[] {
  const rate = report.scheduling.parameter === "" ? [] : [rateColumn(report)];
  return ["Controller", "Design", ...rate, "Cost bound", "Actual cost", "Settling time", "Peak input", "Saturated", "Outcome"];
}

/** A plant without a parameter has no such column. */
function rateColumn(report: Report): string {
  return `Proved up to ${rateText(report.scheduling.parameter)}`;
}

export function comparisonTable(report: Report, selection: Selection, theme: Theme): HTMLElement {
  const unit = report.plant.inputs[0]?.unit ?? "";
  const names = columns(report);
  const body = el("tbody", {}, ...report.runs.map((run) => tableRow(report, run, unit, selection, theme)));
  const head = el("tr", {}, el("th", { class: "col-show", scope: "col" }, el("span", { class: "sr-only" }, "Shown")), ...names.map((name, i) => el("th", { scope: "col", class: i >= 2 && i <= names.length - 2 ? "num" : "" }, name)));
  return el(
    "section",
    { class: "panel table-panel", "aria-label": "Comparison of the controllers" },
    el("div", { class: "table-scroll" }, el("table", { class: "runs", id: "runs" }, el("thead", {}, head), body)),
    verdictLegend(report),
  );
}

function tableRow(report: Report, run: Run, unit: string, selection: Selection, theme: Theme): HTMLElement {
  const checkbox = el("input", { type: "checkbox", "aria-label": `Show ${run.label}`, onchange: () => selection.setVisible(run, checkbox.checked) });
  const name = el("button", { type: "button", class: "run-name", title: "Bring out this run", onclick: (e: Event) => (e.stopPropagation(), selection.toggleSelected(run)) }, run.label);
  const cell = (label: string, cls: string, ...children: (Node | string | null | false)[]): HTMLElement => el("td", { class: cls, "data-label": label }, ...children);
  const verdict = verdictButton(run.verdict, `what the design of ${run.label} rests on`);
  const row = el(
    "tr",
    {
      "data-run": run.id,
      onpointerenter: () => selection.hover(run),
      onpointerleave: () => selection.hover(null),
      onfocusin: () => selection.hover(run),
      onfocusout: () => selection.hover(null),
      onclick: (event: MouseEvent) => {
        if (!(event.target as Element).closest("input, button")) selection.toggleSelected(run);
      },
    },
    el("td", { class: "col-show" }, checkbox),
    el("th", { scope: "row", class: "col-name" }, el("div", { class: "run-head" }, letterBadge(report, run, theme), name, lineSample(run, theme)), el("div", { class: "run-sub" }, run.controller)),
    cell("Design", "col-verdict", verdict, el("div", { class: "run-sub", title: "Largest singular value of K over the grid points" }, `largest gain ${about(run.largest_gain)}`)),
    report.scheduling.parameter !== "" && cell(rateColumn(report), "num col-rate", ...provedRate(report, run)),
    cell("Cost bound", "num col-bound", ...costBound(report, run)),
    cell("Actual cost", "num", ...actualCost(run)),
    cell("Settling time", "num", run.settling_time_s === null ? dash("not settled") : `${about(run.settling_time_s)} s`),
    cell("Peak input", "num", `${about(run.peak_input)} ${unit}`),
    cell("Saturated", "num", percent(run.saturated_share)),
    cell("Outcome", "col-outcome", outcome(run)),
  );
  disclose(verdict, () => runEvidence({ report, run }), (panel) => {
    const width = columns(report).length + 1;
    row.after(el("tr", { class: "evidence-row", "data-holds-panel": true }, el("td", { colspan: width }, panel)));
  });
  const paint = (): void => {
    checkbox.checked = selection.isVisible(run);
    row.classList.toggle("is-hidden", !selection.isVisible(run));
    row.classList.toggle("is-selected", selection.selected === run);
    row.classList.toggle("is-highlighted", selection.highlighted === run);
    name.setAttribute("aria-pressed", String(selection.selected === run));
    row.style.setProperty("--run", theme.color(run));
  };
  paint();
  selection.changed.listen(paint);
  theme.changed.listen(paint);
  return row;
}

/** The rate for which set and cost bound are proved; where only the set is, that is said below. */
function provedRate(report: Report, run: Run): (Node | string)[] {
  const text = (rate: number): string => (rate === 0 ? "at rest" : `${atLeast(rate)} ${report.scheduling.unit}/s`);
  const set = setRate(run);
  const known = run.proved_rate === null ? dash("set and cost bound are not proved") : text(run.proved_rate);
  const level = run.claims.find((claim) => isProvedSet(claim) && !isOfMember(claim))?.level ?? null;
  const isMore = set !== null && set > (run.proved_rate ?? -1);
  const small = [
    ...(level === null ? [] : [`in ${LYAPUNOV} ≤ ${atLeast(level)}`]),
    ...(isMore ? [`${level === null ? "decrease" : "set"} alone: ${text(set)}`] : []),
  ];
  return [known, ...small.map((line) => el("div", { class: "run-sub" }, line))];
}

function isProvedSet(claim: Claim): boolean {
  return claim.of === "model" && claim.verdict === "proved" && ["invariance", "decrease"].includes(claim.kind);
}

/** Whether it is about an inner set or a point, not about the design itself. */
function isOfMember(claim: Claim): boolean {
  return claim.id.includes("[");
}

/** The rate for which V is proved to decrease in the set; of a family that is for each member to say. */
function setRate(run: Run): number | null {
  if (run.claims.some(isOfMember)) return null;
  const rates = run.claims.filter(isProvedSet).flatMap((claim) => {
    if (!claim.motion) return [];
    return claim.motion.motion === "bounded" ? [claim.motion.rate] : claim.motion.motion === "at-rest" ? [0] : [];
  });
  return rates.length === 0 ? null : Math.max(...rates);
}

/** A bound stands with the system it is of, what it is worth and under which condition, or not at all. */
function costBound(report: Report, run: Run): (Node | string)[] {
  const note = run.guaranteed_cost_note;
  const sub = (...children: (Node | string)[]): HTMLElement => el("div", { class: "run-sub" }, ...children);
  const bound = shownBound(run);
  if (bound === null) return [dash("no bound"), ...(note === "" ? [] : [sub(note)])];
  const worth = sub(el("span", { class: `word-${run.guaranteed_cost_verdict}` }, run.guaranteed_cost_verdict), note === "" ? "" : ` · ${note}`);
  const text = `≤ ${atMost(bound)}`;
  if (run.guaranteed_cost !== null) return [text, worth];
  if (run.plant_cost_bound !== null) return [text, el("div", { class: "run-sub", title: "It does not cover that the controller is sampled, or noise." }, "of the plant in continuous time"), worth];
  return [text, el("div", { class: "run-sub", title: modelGaps(report) }, "of the model"), worth];
}

/** The bound that says most. */
function shownBound(run: Run): number | null {
  return run.guaranteed_cost ?? run.plant_cost_bound ?? run.model_cost_bound;
}

/** What a bound of the model does not cover. */
function modelGaps(report: Report): string {
  const linearisation = report.plant.linear ? "" : "what linearisation leaves out of the plant, ";
  return `A bound of the ${report.plant.linear ? "loop" : "LPV model"} in continuous time. It does not cover ${linearisation}that the controller is sampled, or noise.`;
}

/** The cost of the flight; it may exceed a bound of the model, or one whose conditions the flight left, and then says so. */
function actualCost(run: Run): (Node | string)[] {
  if (run.actual_cost === null) return [dash("no cost: the run did not complete")];
  const bound = shownBound(run);
  const exceeds = bound !== null && run.actual_cost > bound * (1 + 1e-9);
  const text = about(run.actual_cost);
  if (!exceeds) return [text];
  if (run.guaranteed_cost !== null) return [text, el("div", { class: "run-sub outcome-bad", title: "The flight contradicts what is proved" }, "above bound")];
  const isOfModel = run.plant_cost_bound === null;
  const why = `The bound is ${isOfModel ? "of the model " : ""}in continuous time: it does not cover the ${isOfModel ? "plant" : "sampled loop"} that flies`;
  return [text, el("div", { class: "run-sub outcome-bad", title: why }, isOfModel ? "above the bound of the model" : "above the bound in continuous time")];
}

function dash(why: string): HTMLElement {
  return el("span", { class: "muted", title: why, "aria-label": why }, "–");
}

function outcome(run: Run): HTMLElement {
  if (run.outcome.kind === "completed") return el("span", { class: "outcome-ok" }, "completed");
  return el("span", { class: "outcome-bad", title: run.outcome.detail }, el("b", {}, "diverged"), ` at ${about(run.outcome.time_s)} s`);
}

/** Explains the verdicts that occur. */
function verdictLegend(report: Report): HTMLElement {
  const used = new Set<Verdict>(report.runs.flatMap((run) => [run.verdict, ...run.claims.map((c) => c.verdict)]));
  const known = (Object.keys(VERDICT_MEANING) as Verdict[]).filter((v) => used.has(v));
  return el("dl", { class: "verdict-legend" }, ...known.map((v) => el("div", {}, el("dt", {}, verdictChip(v)), el("dd", {}, VERDICT_MEANING[v]))));
}
