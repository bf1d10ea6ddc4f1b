// The legend above the plots: which line is which, with the switches that hold for all plots.

import { letterBadge, lineSample } from "./badge";
import type { Report, Run } from "./data";
import { el, svg } from "./dom";
import { seconds } from "./format";
import type { PlotBoard } from "./plots";
import type { Selection } from "./selection";
import type { Theme } from "./theme";
import type { Timeline } from "./timeline";

export function plotLegend(report: Report, board: PlotBoard, selection: Selection, theme: Theme, timeline: Timeline): HTMLElement {
  const full = el("input", { type: "checkbox", id: "full-range", onchange: () => board.setFullRange(full.checked) });
  const reset = el("button", { type: "button", class: "text-button", id: "reset-zoom", hidden: true, onclick: () => board.resetWindow() }, "Whole time");
  const time = el("output", { class: "legend-time", id: "plots-time", "aria-live": "off" });
  const paintTime = (): void => void (time.textContent = `t = ${seconds(timeline.now)}`);
  paintTime();
  timeline.changed.listen(paintTime);
  board.onWindow = () => (reset.hidden = !board.zoomed);
  return el(
    "div",
    { class: "legend", id: "legend" },
    el("div", { class: "legend-runs" }, ...report.runs.map((run) => legendItem(report, run, selection, theme)), referenceItem(report)),
    el("div", { class: "legend-tools" }, time, reset, el("label", { title: "Scale each plot to everything, also to runs that diverge or have no limits" }, full, "full range")),
  );
}

function legendItem(report: Report, run: Run, selection: Selection, theme: Theme): HTMLElement {
  const button = el(
    "button",
    {
      type: "button",
      class: "legend-item",
      title: `${run.label}: click to hide or show`,
      "aria-label": run.label,
      onclick: () => selection.setVisible(run, !selection.isVisible(run)),
      onpointerenter: () => selection.hover(run),
      onpointerleave: () => selection.hover(null),
      onfocus: () => selection.hover(run),
      onblur: () => selection.hover(null),
    },
    letterBadge(report, run, theme),
    lineSample(run, theme),
    el("span", { class: "legend-label" }, run.label),
  );
  const paint = (): void => {
    button.setAttribute("aria-pressed", String(selection.isVisible(run)));
    button.classList.toggle("is-highlighted", selection.highlighted === run);
  };
  paint();
  selection.changed.listen(paint);
  return button;
}

function referenceItem(report: Report): HTMLElement | null {
  if (!report.reference.some((r) => r !== null)) return null;
  const sample = svg("svg", { viewBox: "0 0 34 10", width: 34, height: 10, class: "line-sample", "aria-hidden": "true" }, svg("line", { x1: 1, y1: 5, x2: 33, y2: 5, "stroke-width": 2, class: "reference-sample" }));
  return el("span", { class: "legend-item legend-fixed" }, sample, el("span", { class: "legend-label" }, "set point"));
}
