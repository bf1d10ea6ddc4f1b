// Flights as geometry: where a body is and how it stands at a time, and the box that the picture shows.
// Nothing here draws.

import type { Report, RigidBody, Run } from "./data";
import { indexBefore } from "./samples";

export type Vec3 = [number, number, number];

/** An axis-aligned box, metres, earth frame. */
export interface Box {
  low: Vec3;
  high: Vec3;
}

/** Columns: the body's x, y and z axis in the earth frame. */
export type BodyAxes = [Vec3, Vec3, Vec3];

/** The rotation earth_from_body = R_xyz(φ, θ, ψ)ᵀ, as its columns: the rows of R_xyz. */
export function bodyAxes(phi: number, theta: number, psi: number): BodyAxes {
  const [sf, cf, st, ct, sp, cp] = [Math.sin(phi), Math.cos(phi), Math.sin(theta), Math.cos(theta), Math.sin(psi), Math.cos(psi)];
  return [
    [ct * cp, cf * sp + sf * st * cp, sf * sp - cf * st * cp],
    [-ct * sp, cf * cp - sf * st * sp, sf * cp + cf * st * sp],
    [st, -sf * ct, cf * ct],
  ];
}

/** A position or attitude (φ, θ, ψ) at a sample, or null where there is none. */
function triple(run: Run, indices: Vec3, sample: number): Vec3 | null {
  const a = run.states[indices[0]]?.[sample] ?? null;
  const b = run.states[indices[1]]?.[sample] ?? null;
  const c = run.states[indices[2]]?.[sample] ?? null;
  return a === null || b === null || c === null ? null : [a, b, c];
}

/** How a flight ends in the picture: flown to the end, diverged inside it, or out of it before that. */
export type Ending = "completed" | "diverged" | "left the view";

/** One run's path, from the start to where it ends in the picture. */
export class Flight {
  /** Positions of the samples `0..count`. */
  readonly points: Vec3[] = [];
  readonly ending: Ending;

  constructor(
    private readonly report: Report,
    private readonly body: RigidBody,
    readonly run: Run,
    clip: Box,
  ) {
    let ending: Ending = run.outcome.kind === "completed" ? "completed" : "diverged";
    for (let i = 0; i < report.time.length; i++) {
      const p = triple(run, body.position, i);
      if (!p) break;
      if (ending === "diverged" && !inside(p, clip)) {
        ending = "left the view";
        break;
      }
      this.points.push(p);
    }
    this.ending = ending;
  }

  /** The time of the last point. */
  get endTime(): number {
    return this.report.time[Math.max(0, this.points.length - 1)]!;
  }

  /** The last point at or before `t`, and how far `t` is on the way to the next one, 0 to 1. */
  at(t: number): { index: number; fraction: number } {
    const { time } = this.report;
    const last = this.points.length - 1;
    const index = Math.min(indexBefore(time, t), last);
    if (index >= last) return { index: last, fraction: 0 };
    return { index, fraction: Math.min(Math.max((t - time[index]!) / (time[index + 1]! - time[index]!), 0), 1) };
  }

  /** Position at `t`, between samples on the straight line. */
  position(t: number): Vec3 {
    const { index, fraction } = this.at(t);
    const a = this.points[index] ?? [0, 0, 0];
    const b = this.points[index + 1] ?? a;
    return [a[0] + (b[0] - a[0]) * fraction, a[1] + (b[1] - a[1]) * fraction, a[2] + (b[2] - a[2]) * fraction];
  }

  /** Attitude (φ, θ, ψ) at a sample. */
  attitude(index: number): Vec3 {
    return triple(this.run, this.body.euler_xyz, Math.min(Math.max(index, 0), this.points.length - 1)) ?? [0, 0, 0];
  }

  /** Inputs at `t`: those of the sample before, as a controller holds them. */
  inputs(t: number): (number | null)[] {
    const { index } = this.at(t);
    return this.run.inputs.map((series) => series[index] ?? null);
  }
}

/** A set point of the position, with its yaw, from a time on. */
export interface SetPoint {
  time_s: number;
  position: Vec3;
  yaw_rad: number;
}

/** More changes than this are a reference that moves: a line, not points. */
const MOST_SET_POINTS = 30;

/** The set points one after the other; empty if the position has no reference or one that moves all the time. */
export function setPoints(report: Report, body: RigidBody): SetPoint[] {
  const found: SetPoint[] = [];
  for (let i = 0; i < report.time.length; i++) {
    const position = referenceAt(report, body, i);
    const yaw_rad = report.reference[body.euler_xyz[2]]?.[i] ?? 0;
    const last = found.at(-1);
    if (!position || (last && samePoint(last.position, position) && last.yaw_rad === yaw_rad)) continue;
    found.push({ time_s: report.time[i]!, position, yaw_rad });
    if (found.length > MOST_SET_POINTS) return [];
  }
  return found;
}

function referenceAt(report: Report, body: RigidBody, sample: number): Vec3 | null {
  const [x, y, z] = body.position.map((i) => report.reference[i]?.[sample] ?? null);
  return x == null || y == null || z == null ? null : [x, y, z];
}

function samePoint(a: Vec3, b: Vec3): boolean {
  return a[0] === b[0] && a[1] === b[1] && a[2] === b[2];
}

/** How far beyond its set points a completed run may lead the view, in sizes of the set points' box. */
const COMPLETED_REACH = 1;
/** The same for a run that diverged. */
const DIVERGED_REACH = 0.3;
/** How far outside the fitted box a diverging run is still drawn. */
const CLIP_REACH = 0.1;

/** The box that the camera fits, and the one at which diverging runs are cut off. */
export function viewBoxes(report: Report, body: RigidBody): { fit: Box; clip: Box } {
  const box = new BoxBuilder();
  for (let i = 0; i < report.time.length; i++) box.add(referenceAt(report, body, i));
  const completed = report.runs.filter((r) => r.outcome.kind === "completed");
  for (const run of report.runs) box.add(triple(run, body.position, 0));
  if (box.size() === 0) for (const run of completed) report.time.forEach((_, i) => box.add(triple(run, body.position, i)));
  const least = 8 * body.arm_length_m;
  const base = box.box();
  const size = Math.max(box.size(), least);
  const reach = new Map(report.runs.map((run) => [run, grow(base, size * (run.outcome.kind === "completed" ? COMPLETED_REACH : DIVERGED_REACH))]));
  for (const run of report.runs) {
    for (let i = 0; i < report.time.length; i++) {
      const p = triple(run, body.position, i);
      if (!p) break;
      const allowed = reach.get(run)!;
      box.add(p.map((v, k) => Math.min(Math.max(v, allowed.low[k]!), allowed.high[k]!)) as Vec3);
      if (run.outcome.kind !== "completed" && !inside(p, allowed)) break;
    }
  }
  const fit = grow(box.box(), Math.max(0, least - box.size()) / 2);
  return { fit, clip: grow(fit, CLIP_REACH * size) };
}

class BoxBuilder {
  private readonly low: Vec3 = [Infinity, Infinity, Infinity];
  private readonly high: Vec3 = [-Infinity, -Infinity, -Infinity];

  add(p: Vec3 | null): void {
    if (!p) return;
    for (let k = 0; k < 3; k++) {
      this.low[k] = Math.min(this.low[k]!, p[k]!);
      this.high[k] = Math.max(this.high[k]!, p[k]!);
    }
  }

  size(): number {
    return Math.max(0, ...this.high.map((h, k) => h - this.low[k]!));
  }

  box(): Box {
    return this.low[0] <= this.high[0] ? { low: [...this.low], high: [...this.high] } : { low: [-1, -1, 0], high: [1, 1, 1] };
  }
}

function grow(box: Box, by: number): Box {
  return { low: box.low.map((v) => v - by) as Vec3, high: box.high.map((v) => v + by) as Vec3 };
}

function inside(p: Vec3, box: Box): boolean {
  return p.every((v, k) => v >= box.low[k]! && v <= box.high[k]!);
}

/** The time at which the page opens: where the completed runs are farthest apart, so that one sees them all. */
export function opening(report: Report): number {
  const { time, runs } = report;
  const channels = report.plant.scene?.position ?? report.plant.states.map((_, i) => i);
  const completed = runs.filter((r) => r.outcome.kind === "completed");
  const stride = Math.max(1, Math.floor(time.length / 500));
  let best = time.length - 1;
  let bestSpread = 0;
  for (let i = 0; i < time.length; i += stride) {
    let spread = 0;
    for (const c of channels) {
      const values = completed.flatMap((run) => run.states[c]?.[i] ?? []);
      if (values.length < 2) continue;
      const mean = values.reduce((a, b) => a + b) / values.length;
      spread += values.reduce((sum, v) => sum + Math.abs(v - mean), 0);
    }
    if (spread > bestSpread) {
      bestSpread = spread;
      best = i;
    }
  }
  return time[best]!;
}
