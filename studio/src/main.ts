// Puts the page together.

import { checksSection, notesSection } from "./checks";
import { DataError, parseReport, type Report, type Run } from "./data";
import { closePanel } from "./disclosure";
import { el } from "./dom";
import * as figures from "./figures";
import { opening } from "./flight";
import { pageHeader } from "./header";
import { plotLegend } from "./legend";
import { PlotBoard, type PlotGroup } from "./plots";
import { scenePanel } from "./scene";
import { Selection } from "./selection";
import { comparisonTable } from "./table";
import { Theme } from "./theme";
import { Timeline } from "./timeline";
import { transportBar } from "./transport";

function showPage(app: HTMLElement, report: Report): void {
  document.title = `${report.title} – lpv`;
  const theme = new Theme();
  const selection = new Selection();
  const timeline = new Timeline(report.time[0]!, report.time.at(-1)!, opening(report));
  addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !closePanel()) selection.select(null);
  });
  const board = new PlotBoard(report, timeline, selection, theme);

  const sections = (groups: (PlotGroup | null)[]): HTMLElement[] => groups.flatMap((g) => (g ? [board.section(g)] : []));
  const scene = report.plant.scene ? scenePanel(report, report.plant.scene, timeline, selection, theme) : null;
  const plots = el(
    "div",
    { class: "plots" },
    plotLegend(report, board, selection, theme, timeline),
    ...sections([figures.responses(report), figures.inputs(report), figures.certifiedSet(report), figures.cost(report), figures.weights(report), figures.otherStates(report)]),
  );
  app.replaceChildren(
    pageHeader(report, theme),
    comparisonTable(report, selection, theme),
    el("div", { class: scene && !scene.classList.contains("is-missing") ? "flight" : "flight flight-plots-only" }, scene, plots),
    ...perRun(report, board, figures.estimatedRuns(report), figures.estimation),
    ...perRun(report, board, figures.measuredRuns(report), figures.measurements),
    checksSection(report, theme),
    ...[notesSection(report)].filter((s) => s !== null),
    transportBar(report, timeline),
  );
}

/** A group that shows one run at a time; with several such runs, a list to choose from. */
function perRun(report: Report, board: PlotBoard, runs: Run[], group: (report: Report, run: Run) => PlotGroup): HTMLElement[] {
  if (runs.length === 0) return [];
  const holder = el("div", { class: "per-run" });
  const show = (run: Run): void => {
    for (const old of holder.children) board.remove(old as HTMLElement);
    const choice = runs.length > 1 ? el("select", { "aria-label": "Run", onchange: () => show(runs[choice!.selectedIndex]!) }, ...runs.map((r) => el("option", { selected: r === run }, `${board.letter(r)}: ${r.label}`))) : null;
    holder.replaceChildren(board.section({ ...group(report, run), ...(choice ? { control: choice } : {}) }));
  };
  show(runs[0]!);
  return [holder];
}

function showProblems(app: HTMLElement, problems: string[]): void {
  app.replaceChildren(
    el("section", { class: "panel load-error", role: "alert", id: "load-error" }, el("h1", {}, "This report cannot be shown"), el("ul", {}, ...problems.map((p) => el("li", {}, p)))),
  );
}

const app = document.getElementById("app")!;
try {
  showPage(app, parseReport(document.getElementById("report-data")!.textContent ?? ""));
} catch (error) {
  if (!(error instanceof DataError)) {
    showProblems(app, [`A defect of the page: ${error instanceof Error ? error.message : String(error)}`]);
    throw error;
  }
  new Theme();
  showProblems(app, error.problems);
}
