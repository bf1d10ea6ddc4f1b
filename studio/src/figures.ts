// Which plots the page has. A new plot is a new `PlotSpec` in one of these groups, or a new group.

import { letter } from "./badge";
import type { Channel, Report, Run, Series } from "./data";
import { el } from "./dom";
import { displayFactor, displayUnit, percent, symbol, symbolText } from "./format";
import type { Curve, PlotSpec } from "./plot";
import type { PlotGroup } from "./plots";
import { roughness, scaled } from "./samples";

/** From this roughness on a curve is noise: drawn thin, solid and behind the others. */
const NOISY = 60;

/** A plot of one channel: what it shows is in the shown unit already. */
function plot(id: string, channel: Channel, curves: Curve[], more: Partial<PlotSpec> = {}): PlotSpec {
  return { id, title: symbol(channel.name), name: symbolText(channel.name), unit: displayUnit(channel.unit), curves, ...more };
}

function curve(run: Run | null, kind: Curve["kind"], values: Series | undefined, unit: string): Curve {
  return { run, kind, values: scaled(values ?? [], displayFactor(unit)) };
}

/** One state of all runs against its reference. */
function statePlot(report: Report, state: number): PlotSpec {
  const channel = report.plant.states[state]!;
  const reference = report.reference[state];
  return plot(`state-${state}`, channel, [
    ...(reference ? [curve(null, "reference", reference, channel.unit)] : []),
    ...report.runs.flatMap((run) => (run.governed?.[state] ? [curve(run, "governed", run.governed[state], channel.unit)] : [])),
    ...report.runs.map((run) => curve(run, "line", run.states[state], channel.unit)),
  ]);
}

/** The states that tell the story: where the body is, else what has a reference, else all. */
function mainStates(report: Report): number[] {
  const { scene, states } = report.plant;
  if (scene) return [...scene.position, ...scene.euler_xyz];
  const all = states.map((_, i) => i);
  const referenced = all.filter((i) => report.reference[i]);
  return referenced.length > 0 ? referenced : all;
}

/** Whether a run settles a full turn away from its set point, as it may when the error is wrapped. */
function isFullTurnOff(report: Report, state: number): boolean {
  const target = report.reference[state]?.at(-1) ?? null;
  if (report.plant.states[state]!.unit !== "rad" || target === null) return false;
  return report.runs.some((run) => run.outcome.kind === "completed" && Math.abs((run.states[state]?.at(-1) ?? target) - target) > 1.5 * Math.PI);
}

export function responses(report: Report): PlotGroup {
  const states = mainStates(report);
  return {
    id: "responses",
    title: report.plant.scene ? "Position and attitude" : "Responses",
    caption: `Grey: set point.${report.runs.some((run) => run.governed) ? " Dotted: reference that a governor makes of it." : ""}${states.some((i) => isFullTurnOff(report, i)) ? " Angles a full turn apart are the same attitude." : ""}`,
    rows: Math.ceil(states.length / 2),
    plots: states.map((i) => statePlot(report, i)),
  };
}

export function otherStates(report: Report): PlotGroup | null {
  const main = new Set(mainStates(report));
  const rest = report.plant.states.flatMap((_, i) => (main.has(i) ? [] : [i]));
  if (rest.length === 0) return null;
  return { id: "other-states", title: "Other states", caption: "", rows: Math.ceil(rest.length / 2), plots: rest.map((i) => statePlot(report, i)), folded: true };
}

export function inputs(report: Report): PlotGroup {
  const plots = report.plant.inputs.map((channel, i) =>
    plot(`input-${i}`, channel, noisyFirst(report.runs.map((run) => curve(run, "line", run.inputs[i], channel.unit))), {
      limits: report.runs.map((run) => {
        const factor = displayFactor(channel.unit);
        const { min, max } = run.input_limits[i]!;
        return { run, min: min === null ? null : min * factor, max: max === null ? null : max * factor };
      }),
    }),
  );
  return { id: "inputs", title: "Inputs", caption: "After saturation. Red dashes: limits.", rows: Math.ceil(plots.length / 2), plots };
}

/** Noise behind the rest, which it would cover. */
function noisyFirst(curves: Curve[]): Curve[] {
  const noisy = (c: Curve): boolean => roughness(c.values) > NOISY;
  return [...curves.filter(noisy).map((c) => ({ ...c, thin: true })), ...curves.filter((c) => !noisy(c))];
}

export function cost(report: Report): PlotGroup {
  return {
    id: "cost",
    title: "Accumulated cost",
    caption: "What each run has cost so far.",
    rows: 1,
    plots: [plot("cost", { name: "J", unit: "" }, report.runs.map((run) => curve(run, "line", run.cost, "")))],
  };
}

/** How far into its certified set the error of each run goes. */
export function certifiedSet(report: Report): PlotGroup | null {
  const runs = report.runs.filter((run) => run.set_share !== null);
  if (runs.length === 0) return null;
  const limits = runs.map((run) => ({ run, min: null, max: 1 }));
  const curves = runs.map((run) => curve(run, "line", run.set_share!, ""));
  const title = el("span", {}, el("i", {}, "V"), "/", el("i", {}, "γ"));
  return {
    id: "certified-set",
    title: "Certified set",
    caption: "Level of the error in the set that holds it: below 1 is inside.",
    rows: 1,
    plots: [plot("set-share", { name: "V/γ", unit: "" }, curves, { title, name: "V/γ", limits })],
  };
}

export function weights(report: Report): PlotGroup | null {
  const names = report.scheduling.weights;
  if (names.length === 0) return null;
  return {
    id: "weights",
    title: "Scheduling weights",
    caption: "",
    rows: Math.ceil(names.length / 2),
    plots: names.map((name, i) => plot(`weight-${i}`, { name, unit: "" }, report.runs.map((run) => curve(run, "line", run.weights[i], "")))),
  };
}

/** Runs with an estimator; one of them is shown at a time. */
export function estimatedRuns(report: Report): Run[] {
  return report.runs.filter((run) => run.estimation !== null);
}

export function measuredRuns(report: Report): Run[] {
  return report.runs.filter((run) => run.measurement !== null && report.plant.outputs.length > 0);
}

export function estimation(report: Report, run: Run): PlotGroup {
  const { error, sigma3, inside_share } = run.estimation!;
  return {
    id: "estimation",
    title: "Estimation errors",
    caption: `Run ${letter(report, run)}: true state minus estimate; band: ±3σ by the estimator's own covariance. The share inside should be about 99.7 %.`,
    rows: Math.ceil(error.length / 2),
    small: true,
    single: true,
    plots: report.plant.states.map((channel, i) => {
      const sigma = sigma3[i] ?? [];
      return plot(
        `error-${i}`,
        channel,
        [curve(null, "sigma", sigma, channel.unit), curve(null, "sigma", sigma.map((v) => (v === null ? null : -v)), channel.unit), curve(run, "line", error[i], channel.unit)],
        { title: el("span", {}, "error of ", symbol(channel.name)), name: `error of ${symbolText(channel.name)}`, note: `${percent(inside_share[i]!)} inside` },
      );
    }),
  };
}

export function measurements(report: Report, run: Run): PlotGroup {
  const plots = report.plant.outputs.map((channel, i) => {
    const state = report.plant.states.findIndex((s) => s.name === channel.name);
    const actual = state >= 0 ? [curve(run, "line", run.states[state], channel.unit)] : [];
    return plot(`output-${i}`, channel, [curve(null, "points", run.measurement![i], channel.unit), ...actual]);
  });
  return {
    id: "measurements",
    title: "Measurements",
    caption: `Run ${letter(report, run)}: dots are measured, the line is the true state.`,
    rows: Math.ceil(plots.length / 2),
    single: true,
    plots,
  };
}
