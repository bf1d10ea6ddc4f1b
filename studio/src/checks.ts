// What was checked about each design, and the notes.

import { letterBadge, verdictChip } from "./badge";
import type { Report, Run } from "./data";
import { el } from "./dom";
import { seconds } from "./format";
import type { Theme } from "./theme";

export function checksSection(report: Report, theme: Theme): HTMLElement {
  const runs = report.runs.filter((run) => run.claims.length > 0 || run.outcome.kind === "diverged");
  return el("section", { class: "checks", id: "checks" }, el("h2", {}, "Checks"), ...runs.map((run) => runChecks(report, run, theme)));
}

function runChecks(report: Report, run: Run, theme: Theme): HTMLElement {
  const counts = new Map<string, number>();
  for (const claim of run.claims) counts.set(claim.verdict, (counts.get(claim.verdict) ?? 0) + 1);
  const summary = [...counts].map(([verdict, count]) => `${count} ${verdict}`).join(", ");
  const bad = run.outcome.kind === "diverged" || run.claims.some((c) => c.verdict === "refuted");
  return el(
    "details",
    { class: "panel check-run", open: bad },
    el("summary", {}, letterBadge(report, run, theme), el("b", {}, run.label), el("span", { class: "muted" }, summary)),
    run.outcome.kind === "diverged" && el("p", { class: "outcome-bad" }, `Diverged at ${seconds(run.outcome.time_s)} in ${run.outcome.state}. ${run.outcome.detail}`),
    el(
      "ul",
      { class: "claims" },
      ...run.claims.map((claim) => el("li", {}, verdictChip(claim.verdict), el("div", {}, el("div", { class: "claim" }, claim.claim), claim.detail !== "" && el("div", { class: "run-sub" }, claim.detail)))),
    ),
  );
}

export function notesSection(report: Report): HTMLElement | null {
  if (report.notes.length === 0) return null;
  return el("section", { class: "notes", id: "notes" }, el("h2", {}, "Notes"), el("ul", { class: "panel" }, ...report.notes.map((note) => el("li", {}, note))));
}
