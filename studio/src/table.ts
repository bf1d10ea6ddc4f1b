// The comparison table: one row per controller. On a narrow screen each row becomes a card.

import { letterBadge, lineSample, VERDICT_MEANING, verdictChip } from "./badge";
import type { Report, Run, Verdict } from "./data";
import { el } from "./dom";
import { number, percent, seconds } from "./format";
import type { Selection } from "./selection";
import type { Theme } from "./theme";

const COLUMNS = ["Controller", "Design", "Cost bound", "Actual cost", "Settling time", "Peak input", "Saturated", "Outcome"] as const;

export function comparisonTable(report: Report, selection: Selection, theme: Theme): HTMLElement {
  const unit = report.plant.inputs[0]?.unit ?? "";
  const body = el("tbody", {}, ...report.runs.map((run) => tableRow(report, run, unit, selection, theme)));
  const head = el("tr", {}, el("th", { class: "col-show", scope: "col" }, el("span", { class: "sr-only" }, "Shown")), ...COLUMNS.map((name, i) => el("th", { scope: "col", class: i >= 2 && i <= 6 ? "num" : "" }, name)));
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
    cell("Design", "col-verdict", verdictChip(run.verdict)),
    cell("Cost bound", "num col-bound", ...guaranteedCost(run)),
    cell("Actual cost", "num", ...actualCost(run)),
    cell("Settling time", "num", run.settling_time_s === null ? dash("not settled") : seconds(run.settling_time_s)),
    cell("Peak input", "num", `${number(run.peak_input, 4)} ${unit}`),
    cell("Saturated", "num", percent(run.saturated_share)),
    cell("Outcome", "col-outcome", outcome(run)),
  );
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

/** A bound stands with what it is worth and under which condition, or not at all. */
function guaranteedCost(run: Run): (Node | string)[] {
  const note = run.guaranteed_cost_note;
  if (run.guaranteed_cost === null) return [dash("no bound"), ...(note === "" ? [] : [el("div", { class: "run-sub" }, note)])];
  const small = el("div", { class: "run-sub" }, el("span", { class: `word-${run.guaranteed_cost_verdict}` }, run.guaranteed_cost_verdict), note === "" ? "" : ` · ${note}`);
  return [`≤ ${number(run.guaranteed_cost, 5)}`, small];
}

/** The cost of the flight; it may exceed a bound whose conditions the flight left, and then says so. */
function actualCost(run: Run): (Node | string)[] {
  if (run.actual_cost === null) return [dash("no cost: the run did not complete")];
  const exceeds = run.guaranteed_cost !== null && run.actual_cost > run.guaranteed_cost * (1 + 1e-9);
  const text = number(run.actual_cost, 5);
  return exceeds ? [text, el("div", { class: "run-sub outcome-bad", title: "The flight left the conditions under which the bound holds" }, "above bound")] : [text];
}

function dash(why: string): HTMLElement {
  return el("span", { class: "muted", title: why, "aria-label": why }, "–");
}

function outcome(run: Run): HTMLElement {
  if (run.outcome.kind === "completed") return el("span", { class: "outcome-ok" }, "completed");
  return el("span", { class: "outcome-bad", title: run.outcome.detail }, el("b", {}, "diverged"), ` at ${seconds(run.outcome.time_s)}`);
}

/** Explains the verdicts that occur. */
function verdictLegend(report: Report): HTMLElement {
  const used = new Set<Verdict>(report.runs.flatMap((run) => [run.verdict, ...run.claims.map((c) => c.verdict)]));
  const known = (Object.keys(VERDICT_MEANING) as Verdict[]).filter((v) => used.has(v));
  return el("dl", { class: "verdict-legend" }, ...known.map((v) => el("div", {}, el("dt", {}, verdictChip(v)), el("dd", {}, VERDICT_MEANING[v]))));
}
