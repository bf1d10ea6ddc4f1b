// The marks by which a run is known all over the page: its letter, its line sample, its verdict.

import type { Report, Run, Verdict } from "./data";
import { el, svg } from "./dom";
import { dash, type Theme } from "./theme";

/** What a verdict means, in one line. */
export const VERDICT_MEANING: Record<Verdict, string> = {
  proved: "holds for all parameters, between grid points too, with rounding accounted for",
  numerical: "holds at the points checked; not proved",
  refuted: "a counter-example was found",
  undecided: "could not be decided",
};

const VERDICT_SIGN: Record<Verdict, string> = { proved: "✓", numerical: "≈", refuted: "✕", undecided: "?" };

/** A chip with the verdict: sign, word and colour. */
export function verdictChip(verdict: Verdict): HTMLElement {
  return el("span", { class: `chip chip-${verdict}`, title: `${verdict}: ${VERDICT_MEANING[verdict]}` }, ...chipFace(verdict));
}

/** The chip as a button that opens what the verdict rests on; `purpose` is for those who do not see where it stands. */
export function verdictButton(verdict: Verdict, purpose: string): HTMLButtonElement {
  const attributes = { type: "button", class: `chip chip-button chip-${verdict}`, title: `${verdict}: ${VERDICT_MEANING[verdict]}. Click for what it rests on`, "aria-label": `${verdict}; ${purpose}` };
  return el("button", attributes, ...chipFace(verdict), el("span", { class: "chip-arrow", "aria-hidden": "true" }));
}

function chipFace(verdict: Verdict): (Node | string)[] {
  return [el("span", { class: "chip-sign", "aria-hidden": "true" }, VERDICT_SIGN[verdict]), verdict];
}

/** A, B, … Z, then AA, AB, …: the run's name where there is room for one letter. */
export function letter(report: Report, run: Run): string {
  let index = report.runs.indexOf(run);
  let text = "";
  do {
    text = String.fromCharCode(65 + (index % 26)) + text;
    index = Math.floor(index / 26) - 1;
  } while (index >= 0);
  return text;
}

/** The run's letter on its colour. */
export function letterBadge(report: Report, run: Run, theme: Theme): HTMLElement {
  const badge = el("span", { class: "letter" }, letter(report, run));
  const paint = (): void => badge.style.setProperty("--run", theme.color(run));
  paint();
  theme.changed.listen(paint);
  return badge;
}

/** A sample of the run's line: colour and dash. */
export function lineSample(run: Run, theme: Theme): SVGElement {
  const line = svg("line", { x1: 1, y1: 5, x2: 33, y2: 5, "stroke-width": 2.5, "stroke-dasharray": dash(run).join(" ") });
  const paint = (): void => line.setAttribute("stroke", theme.color(run));
  paint();
  theme.changed.listen(paint);
  return svg("svg", { viewBox: "0 0 34 10", width: 34, height: 10, class: "line-sample", "aria-hidden": "true" }, line);
}
