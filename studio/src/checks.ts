// What was checked about each design, and the notes.

import { letterBadge } from "./badge";
import type { Report, Run } from "./data";
import { el } from "./dom";
import { claimList } from "./evidence";
import { about } from "./format";
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
    { class: "panel check-run", open: bad, "data-run": run.id },
    el("summary", {}, letterBadge(report, run, theme), el("b", {}, run.label), el("span", { class: "muted" }, summary)),
    run.outcome.kind === "diverged" && el("p", { class: "outcome-bad" }, `Diverged at ${about(run.outcome.time_s)} s in ${run.outcome.state}. ${run.outcome.detail}`),
    claimList({ report, run }, run.claims),
  );
}

export function notesSection(report: Report): HTMLElement | null {
  if (report.notes.length === 0) return null;
  return el("section", { class: "notes", id: "notes" }, el("h2", {}, "Notes"), el("ul", { class: "panel" }, ...report.notes.map((note) => el("li", {}, note))));
}
