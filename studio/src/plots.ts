// All plots together: one time window, one clock, one legend, one readout at the pointer.

import { letter } from "./badge";
import type { Report, Run } from "./data";
import { el } from "./dom";
import { about } from "./format";
import { Plot, type Curve, type PlotSpec } from "./plot";
import { indexNearest } from "./samples";
import type { Selection } from "./selection";
import type { Theme } from "./theme";
import type { Timeline } from "./timeline";

/** A titled set of plots, drawn in a grid. */
export interface PlotGroup {
  id: string;
  title: string;
  caption: string;
  /** Plots per column when there are two columns: they then run down the first column, then the second. */
  rows: number;
  plots: PlotSpec[];
  /** More than two columns, smaller plots. */
  small?: boolean;
  /** Closed at first. */
  folded?: boolean;
  /** One run at a time: all curves solid. */
  single?: boolean;
  /** A control that stands at the right of the title. */
  control?: HTMLElement;
}

const SHORTEST_WINDOW_S = 1e-3;

export class PlotBoard {
  window: [number, number];
  fullRange = false;
  private readonly plots: Plot[] = [];
  private readonly byElement = new Map<Element, Plot>();
  private readonly tip = el("div", { class: "plot-tip", hidden: true });
  private readonly views = new IntersectionObserver((entries) => {
    for (const entry of entries) this.byElement.get(entry.target)?.setInView(entry.isIntersecting);
  }, { rootMargin: "300px" });
  private readonly sizes = new ResizeObserver((entries) => {
    for (const entry of entries) this.byElement.get(entry.target)?.resize();
  });

  constructor(
    private readonly report: Report,
    readonly timeline: Timeline,
    readonly selection: Selection,
    readonly theme: Theme,
  ) {
    this.window = this.wholeWindow();
    document.body.append(this.tip);
    timeline.changed.listen(() => this.plots.forEach((p) => p.moveNow()));
    selection.changed.listen(() => this.refresh("ranges"));
    theme.changed.listen(() => this.refresh("look"));
  }

  /** Builds a group's elements; its plots are drawn when they come into view. */
  section(group: PlotGroup): HTMLElement {
    const plots = group.plots.map((spec) => this.add(spec));
    const grid = el("div", { class: group.small ? "plot-grid plot-grid-small" : "plot-grid", style: `--rows: ${group.rows}` }, ...plots.map((p) => p.element));
    const heading = el("div", { class: "group-head" }, el("h3", {}, group.title), el("p", { class: "caption" }, group.caption), group.control);
    if (!group.folded) return el("section", { class: "plot-group", id: `plots-${group.id}` }, heading, grid);
    return el("details", { class: "plot-group", id: `plots-${group.id}` }, el("summary", {}, heading), grid);
  }

  /** Takes a group's plots away, before the group is built anew. */
  remove(section: HTMLElement): void {
    for (const plot of this.plots.filter((p) => section.contains(p.element))) {
      this.views.unobserve(plot.element);
      this.sizes.unobserve(plot.element);
      this.byElement.delete(plot.element);
      this.plots.splice(this.plots.indexOf(plot), 1);
      plot.destroy();
    }
  }

  letter(run: Run): string {
    return letter(this.report, run);
  }

  /** With one run there is nothing to tell apart. */
  plainLines(spec: PlotSpec): boolean {
    return new Set(spec.curves.flatMap((c) => (c.run ? [c.run] : []))).size < 2;
  }

  setWindow(from: number, to: number): void {
    const [start, end] = this.wholeWindow();
    const low = Math.max(start, Math.min(from, to));
    const high = Math.min(end, Math.max(from, to));
    if (high - low < SHORTEST_WINDOW_S) return;
    this.window = [low, high];
    this.refresh("ranges");
    this.plots.forEach((p) => p.moveNow());
    this.onWindow?.();
  }

  resetWindow(): void {
    this.setWindow(...this.wholeWindow());
  }

  get zoomed(): boolean {
    const [start, end] = this.wholeWindow();
    return this.window[0] > start || this.window[1] < end;
  }

  /** Called when the window changed. */
  onWindow: (() => void) | null = null;

  setFullRange(full: boolean): void {
    this.fullRange = full;
    this.refresh("ranges");
  }

  /** Shows the values at the pointer; no plot hides them. */
  readout(plot: Plot | null, t: number, x: number, y: number): void {
    if (!plot) {
      this.tip.hidden = true;
      return;
    }
    const i = indexNearest(this.report.time, t);
    const row = (name: string, color: string, values: (number | null | undefined)[]): HTMLElement =>
      el("tr", {}, el("th", { style: `color: ${color}` }, name), ...values.map((v) => el("td", {}, v === null || v === undefined ? "–" : about(v))));
    const rows = [...plot.spec.curves]
      .sort((a, b) => this.order(a) - this.order(b))
      .filter((c) => c.run === null || this.selection.isVisible(c.run))
      .flatMap((c) => {
        const name = this.curveName(c, plot.spec);
        return name === null ? [] : [row(name, c.run ? this.theme.color(c.run) : "inherit", [c.values[i]])];
      });
    this.tip.replaceChildren(el("div", { class: "tip-time" }, `${about(this.report.time[i]!)} s`), el("table", {}, ...rows));
    this.tip.hidden = false;
    const { offsetWidth: width, offsetHeight: height } = this.tip;
    const left = x + 18 + width > innerWidth ? x - 18 - width : x + 18;
    const top = Math.min(Math.max(8, y - height / 2), innerHeight - height - 8);
    this.tip.style.transform = `translate(${Math.round(left)}px, ${Math.round(top)}px)`;
  }

  /** The runs' order, whatever order they are drawn in. */
  private order(curve: Curve): number {
    return curve.run ? this.report.runs.indexOf(curve.run) : -1;
  }

  private curveName(curve: Curve, spec: PlotSpec): string | null {
    switch (curve.kind) {
      case "reference":
        return "ref.";
      case "governed":
        return curve.run ? `${this.letter(curve.run)} ref.` : null;
      case "points":
        return "meas.";
      case "sigma":
        return spec.curves.find((c) => c.kind === "sigma") === curve ? "3σ" : null;
      case "line":
        return curve.run ? this.letter(curve.run) : "";
    }
  }

  private add(spec: PlotSpec): Plot {
    const plot = new Plot(spec, this.report, this);
    this.plots.push(plot);
    this.byElement.set(plot.element, plot);
    this.views.observe(plot.element);
    this.sizes.observe(plot.element);
    return plot;
  }

  private refresh(what: "look" | "ranges"): void {
    this.plots.forEach((p) => p.refresh(what));
  }

  private wholeWindow(): [number, number] {
    return [this.report.time[0]!, this.report.time.at(-1)!];
  }
}
