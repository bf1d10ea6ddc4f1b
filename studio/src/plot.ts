// One plot: uPlot with the report's manners.
//
// uPlot draws the curves and axes. Added here: the line at the current time, a click that sets the clock, a drag
// that zooms all plots, limits, set-point changes, divergence marks, and a title row that says what is cut off.

import uPlot from "uplot";
import type { Report, Run, Series } from "./data";
import { el } from "./dom";
import { about, fixed } from "./format";
import type { PlotBoard } from "./plots";
import { verticalRange } from "./range";
import { lastIndex } from "./samples";
import { dash } from "./theme";

export type CurveKind = "line" | "reference" | "governed" | "points" | "sigma";

/** One curve of a plot, in shown units. */
export interface Curve {
  /** The run it belongs to; null for what belongs to all. */
  run: Run | null;
  kind: CurveKind;
  values: Series;
  /** Drawn thin and solid: for noise. */
  thin?: boolean;
}

/** What a plot shows. */
export interface PlotSpec {
  /** Stable name, for tests and links. */
  id: string;
  title: HTMLElement;
  /** The title as plain text. */
  name: string;
  unit: string;
  curves: Curve[];
  /** Horizontal dashed lines: limits of these runs. */
  limits?: { run: Run; min: number | null; max: number | null }[];
  /** Plain text at the right of the title row. */
  note?: string;
}

const LINE_PX = 1.6;
const HIGHLIGHTED_PX = 2.4;
const THIN_PX = 0.7;
/** Where one run is alone. */
const PLAIN_PX = 1.2;
const CLICK_SLACK_PX = 4;
const FONT = '11px system-ui, "Segoe UI", Roboto, "Helvetica Neue", sans-serif';

export class Plot {
  readonly element: HTMLElement;
  private readonly frame: HTMLElement;
  private readonly note: HTMLElement;
  private readonly nowLine = el("div", { class: "now-line" });
  private u: uPlot | null = null;
  private inView = false;
  private stale: "nothing" | "look" | "ranges" = "nothing";

  constructor(
    readonly spec: PlotSpec,
    private readonly report: Report,
    private readonly board: PlotBoard,
  ) {
    this.note = el("span", { class: "plot-note" });
    this.frame = el("div", { class: "plot-frame" });
    this.element = el(
      "figure",
      { class: "plot", "data-plot": spec.id, "aria-label": `${spec.name} over time${spec.unit === "" ? "" : `, ${spec.unit}`}` },
      el("figcaption", { class: "plot-title" }, el("span", { class: "plot-name" }, spec.title, spec.unit !== "" && el("span", { class: "unit" }, spec.unit)), this.note),
      this.frame,
    );
  }

  /** The plot came into view or left it: what is out of view is drawn later. */
  setInView(inView: boolean): void {
    this.inView = inView;
    if (!inView) return;
    if (!this.u) this.create();
    else if (this.stale !== "nothing") this.refresh(this.stale);
    this.moveNow();
  }

  resize(): void {
    const width = this.frame.clientWidth;
    if (this.u && width > 0 && width !== this.u.width) this.u.setSize({ width, height: this.u.height });
    this.moveNow();
  }

  /** Draws again: with the same ranges after a change of looks, with new ones after a change of what is shown. */
  refresh(what: "look" | "ranges"): void {
    if (!this.u) return;
    if (!this.inView) {
      if (this.stale !== "ranges") this.stale = what;
      return;
    }
    this.stale = "nothing";
    const u = this.u;
    this.style(u);
    if (what === "look") u.redraw(false);
    else u.setScale("x", { min: this.board.window[0], max: this.board.window[1] });
  }

  /** Puts the line at the shown time. */
  moveNow(): void {
    if (!this.u || !this.inView) return;
    const t = this.board.timeline.now;
    const [from, to] = this.board.window;
    this.nowLine.hidden = t < from || t > to;
    this.nowLine.style.transform = `translateX(${this.u.valToPos(t, "x").toFixed(1)}px)`;
  }

  destroy(): void {
    this.u?.destroy();
    this.u = null;
  }

  private shown(curve: Curve): boolean {
    return curve.run === null || this.board.selection.isVisible(curve.run);
  }

  private create(): void {
    const { spec, board, report } = this;
    const inks = () => board.theme.inks;
    const sigma = spec.curves.flatMap((c, i) => (c.kind === "sigma" ? [i + 1] : []));
    const axis: uPlot.Axis = {
      font: FONT,
      stroke: () => inks().muted,
      grid: { stroke: () => inks().grid, width: 1 },
      ticks: { stroke: () => inks().gridStrong, width: 1, size: 4 },
      gap: 3,
    };
    const options: uPlot.Options = {
      width: Math.max(this.frame.clientWidth, 120),
      height: this.frame.clientHeight || 170,
      legend: { show: false },
      padding: [6, 14, 0, 0],
      cursor: {
        x: true,
        y: false,
        points: { show: false },
        drag: { x: true, y: false, setScale: false, dist: CLICK_SLACK_PX },
        bind: { dblclick: () => () => (board.resetWindow(), null) },
      },
      scales: {
        x: { time: false, range: () => board.window },
        y: { range: (u) => this.range(u) },
      },
      axes: [
        { ...axis, size: 20, label: "time, s", labelFont: FONT, labelSize: 15, labelGap: -1, space: 52, values: (_u, splits) => splits.map((v) => tick(v, splits)) },
        { ...axis, size: 50, space: 26, values: (_u, splits) => splits.map((v) => tick(v, splits)) },
      ],
      series: [{}, ...spec.curves.map((curve) => this.series(curve))],
      bands: sigma.length === 2 ? [{ series: [sigma[0]!, sigma[1]!], fill: () => inks().band }] : [],
      hooks: {
        drawAxes: [(u) => this.drawBehind(u)],
        draw: [(u) => this.drawAbove(u), () => this.moveNow()],
        setSelect: [(u) => this.zoomTo(u)],
      },
    };
    const data: uPlot.AlignedData = [report.time, ...spec.curves.map((c) => c.values)];
    this.frame.replaceChildren();
    const u = new uPlot(options, data, this.frame);
    this.u = u;
    this.style(u);
    this.listen(u);
    u.over.append(this.nowLine);
    this.stale = "nothing";
  }

  private series(curve: Curve): uPlot.Series {
    const inks = () => this.board.theme.inks;
    const color = (): string => (curve.run ? this.board.theme.color(curve.run) : inks().reference);
    switch (curve.kind) {
      case "reference":
        return { stroke: () => inks().reference, width: 1.5, points: { show: false }, paths: tamePath };
      case "governed":
        return { stroke: color, width: 1, dash: [1, 3], points: { show: false }, paths: tamePath };
      case "sigma":
        return { stroke: () => inks().bandEdge, width: 1, points: { show: false } };
      case "points":
        return { stroke: color, width: 0, paths: () => null, points: { show: true, size: 2.5, width: 0, fill: () => inks().muted } };
      case "line":
        return { stroke: color, width: LINE_PX, dash: this.dash(curve), points: { show: false }, paths: tamePath };
    }
  }

  private dash(curve: Curve): number[] {
    return curve.thin || !curve.run || this.board.plainLines(this.spec) ? [] : dash(curve.run);
  }

  /** Visibility and emphasis of each curve. */
  private style(u: uPlot): void {
    const highlighted = this.board.selection.highlighted;
    const emphasised = this.spec.curves.some((c) => c.run === highlighted);
    this.spec.curves.forEach((curve, i) => {
      const series = u.series[i + 1]!;
      const dimmed = highlighted !== null && emphasised && curve.run !== null && curve.run !== highlighted;
      series.show = this.shown(curve);
      series.alpha = dimmed ? 0.18 : curve.thin ? 0.6 : 1;
      if (curve.kind === "line") series.width = curve.thin ? THIN_PX : this.board.plainLines(this.spec) ? PLAIN_PX : curve.run !== null && curve.run === highlighted ? HIGHLIGHTED_PX : LINE_PX;
    });
  }

  private limits(): number[] {
    const values = new Set<number>();
    for (const limit of this.spec.limits ?? []) {
      if (!this.board.selection.isVisible(limit.run)) continue;
      if (limit.min !== null) values.add(limit.min);
      if (limit.max !== null) values.add(limit.max);
    }
    return [...values].sort((a, b) => a - b);
  }

  private range(u: uPlot): [number, number] {
    const [from, to] = u.series[0]!.idxs ?? [0, this.report.time.length - 1];
    const lines = this.spec.curves.filter((c) => this.shown(c));
    const limits = this.limits();
    const range = verticalRange(lines, from, to, limits, this.board.fullRange);
    const notes: string[] = [];
    if (this.spec.note) notes.push(this.spec.note);
    if (limits.length > 0) notes.push(`limits ${limits.map(about).join(", ")}`);
    if (range.clipped.length > 0) notes.push(`${[...new Set(range.clipped)].map((run) => this.board.letter(run)).join(", ")} off scale`);
    this.note.textContent = notes.join(" · ");
    return [range.low, range.high];
  }

  /** Set-point changes and limits, behind the curves. */
  private drawBehind(u: uPlot): void {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    const inks = this.board.theme.inks;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = ratio;
    ctx.strokeStyle = inks.gridStrong;
    ctx.setLineDash([1 * ratio, 3 * ratio]);
    for (const step of this.report.steps) line(ctx, u.valToPos(step.time_s, "x", true), bbox.top, 0, bbox.height);
    ctx.strokeStyle = inks.limit;
    ctx.setLineDash([7 * ratio, 4 * ratio]);
    for (const limit of this.limits()) line(ctx, bbox.left, u.valToPos(limit, "y", true), bbox.width, 0);
    ctx.restore();
  }

  /** A cross where a run diverged. */
  private drawAbove(u: uPlot): void {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.setLineDash([]);
    for (const curve of this.spec.curves) {
      if (curve.kind !== "line" || curve.run?.outcome.kind !== "diverged" || !this.shown(curve)) continue;
      const last = lastIndex(curve.values);
      if (last < 0) continue;
      const x = u.valToPos(this.report.time[last]!, "x", true);
      const r = 4 * ratio;
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      const y = Math.min(Math.max(u.valToPos(curve.values[last]!, "y", true), bbox.top + r), bbox.top + bbox.height - r);
      ctx.strokeStyle = this.board.theme.color(curve.run);
      ctx.lineWidth = 2 * ratio;
      line(ctx, x - r, y - r, 2 * r, 2 * r);
      line(ctx, x - r, y + r, 2 * r, -2 * r);
    }
    ctx.restore();
  }

  private zoomTo(u: uPlot): void {
    if (u.select.width < CLICK_SLACK_PX) return;
    const from = u.posToVal(u.select.left, "x");
    const to = u.posToVal(u.select.left + u.select.width, "x");
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.board.setWindow(from, to);
  }

  /** Pointer: hovering previews, a click sets the clock, a finger scrubs. */
  private listen(u: uPlot): void {
    const over = u.over;
    const timeAt = (event: PointerEvent): number => u.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
    let downX: number | null = null;
    over.addEventListener("pointerdown", (event) => {
      downX = event.clientX;
    });
    over.addEventListener("pointermove", (event) => {
      const t = timeAt(event);
      if (event.pointerType === "mouse") {
        this.board.timeline.hover(t);
        this.board.readout(this, t, event.clientX, event.clientY);
      } else if (downX !== null) {
        this.board.timeline.seek(t);
      }
    });
    over.addEventListener("pointerup", (event) => {
      if (downX !== null && Math.abs(event.clientX - downX) < CLICK_SLACK_PX) this.board.timeline.seek(timeAt(event));
      downX = null;
    });
    over.addEventListener("pointerleave", () => {
      downX = null;
      this.board.timeline.hover(null);
      this.board.readout(null, 0, 0, 0);
    });
  }
}

function line(ctx: CanvasRenderingContext2D, x: number, y: number, dx: number, dy: number): void {
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.lineTo(x + dx, y + dy);
  ctx.stroke();
}

/** How far outside the plot a curve is still followed, in heights of the plot. */
const FOLLOW = 3;

/** Straight lines between samples, cut off far outside: a dashed line to 10⁶ m would be a million dashes. */
const tamePath: uPlot.Series.PathBuilder = (u, index, first, last) => {
  const path = new Path2D();
  const x = u.data[0]!;
  const y = u.data[index]!;
  const { top, height } = u.bbox;
  let pen = false;
  for (let i = first; i <= last; i++) {
    const value = y[i];
    if (value === null || value === undefined) {
      pen = false;
      continue;
    }
    const px = u.valToPos(x[i]!, "x", true);
    const py = Math.min(Math.max(u.valToPos(value, "y", true), top - FOLLOW * height), top + (1 + FOLLOW) * height);
    if (pen) path.lineTo(px, py);
    else path.moveTo(px, py);
    pen = true;
  }
  return { stroke: path, flags: 1 };
};

/** What large tick labels are written in, so that they fit: "20k". */
const LARGE: readonly [number, string][] = [[1e12, "T"], [1e9, "G"], [1e6, "M"], [1e3, "k"]];

/** A tick label with just the decimals that the distance of the ticks asks for. */
function tick(value: number, splits: number[]): string {
  const step = Math.abs((splits[1] ?? 1) - (splits[0] ?? 0)) || 1;
  const size = Math.max(...splits.map(Math.abs));
  const [unit, suffix] = LARGE.find(([least]) => size >= 10 * least) ?? [1, ""];
  let decimals = 0;
  while (decimals < 6 && Math.abs(step / unit - Number((step / unit).toFixed(decimals))) > (1e-6 * step) / unit) decimals++;
  return value === 0 ? "0" : `${fixed(value / unit, decimals)}${suffix}`;
}
