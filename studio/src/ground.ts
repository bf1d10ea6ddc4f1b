// The ground grid with its scale in metres, and an upright scale at the corner that is at the side of the view.

import * as THREE from "three";
import { el } from "./dom";
import type { Box } from "./flight";
import { fixed } from "./format";
import type { Label, LabelLayer } from "./labels";
import { niceStep } from "./samples";
import type { Theme } from "./theme";

/** Grid squares along the longer side, about. */
const SQUARES = 7;
const LABEL_OUT = 0.45;
/** Cosine of the angle to the line of sight from which on an axis is seen end on. */
const END_ON = 0.97;
/** How far below the edge the ground's scale stands when the ground is seen from the side. */
const SIDE_DOWN_PX = 13;
const SIDE_NAME_DOWN_PX = 34;

export class Ground {
  readonly group = new THREE.Group();
  readonly step: number;
  readonly z: number;
  private readonly x: [number, number];
  private readonly y: [number, number];
  /** The grid and what flies above it. */
  readonly box: Box;
  private readonly top: number;
  private readonly lines: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly edge: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly post: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly ticks: { label: Label; axis: "x" | "y" | "z"; value: number }[] = [];

  constructor(fit: Box, layer: LabelLayer) {
    const span = Math.max(fit.high[0] - fit.low[0], fit.high[1] - fit.low[1], 0.5 * (fit.high[2] - fit.low[2]));
    const step = niceStep((span * 2) / SQUARES);
    const down = (v: number): number => Math.floor(v / step + 1e-6) * step;
    const up = (v: number): number => Math.ceil(v / step - 1e-6) * step;
    this.step = step;
    this.x = [down(fit.low[0] - 0.1 * step), up(fit.high[0] + 0.1 * step)];
    this.y = [down(fit.low[1] - 0.1 * step), up(fit.high[1] + 0.1 * step)];
    this.z = fit.low[2] > -0.5 * step ? Math.min(0, down(fit.low[2] + 0.5 * step)) : down(fit.low[2]);
    this.box = { low: [this.x[0], this.y[0], this.z], high: [this.x[1], this.y[1], fit.high[2]] };
    this.top = Math.max(up(fit.high[2]), this.z + step);

    const grid: number[] = [];
    for (const v of range(this.x, step)) grid.push(v, this.y[0], this.z, v, this.y[1], this.z);
    for (const v of range(this.y, step)) grid.push(this.x[0], v, this.z, this.x[1], v, this.z);
    this.lines = segments(grid);
    this.edge = segments([
      ...[this.x[0], this.y[0], this.x[1], this.y[0]],
      ...[this.x[1], this.y[0], this.x[1], this.y[1]],
      ...[this.x[1], this.y[1], this.x[0], this.y[1]],
      ...[this.x[0], this.y[1], this.x[0], this.y[0]],
    ].flatMap((v, i) => (i % 2 === 1 ? [v, this.z] : [v])));
    const heights = range([this.z, this.top], step);
    this.post = segments([0, 0, this.z, 0, 0, this.top, ...heights.flatMap((h) => [-0.06 * step, 0, h, 0.06 * step, 0, h])]);
    this.group.add(this.lines, this.edge, this.post);

    const add = (axis: "x" | "y" | "z", value: number): void => {
      const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
      this.ticks.push({ label: layer.add(el("span", { class: "tick-label" }, fixed(value, decimals)), 3), axis, value });
    };
    for (const v of range(this.x, step)) add("x", v);
    for (const v of range(this.y, step)) add("y", v);
    for (const v of heights.slice(1)) add("z", v);
    for (const axis of ["x", "y", "z"] as const) {
      const ends = { x: this.x, y: this.y, z: [this.z, this.top] as const }[axis];
      const name = layer.add(el("span", { class: "axis-label" }, `${axis}, m`), 2);
      this.ticks.push({ label: name, axis, value: axis === "z" ? ends[1] + 0.45 * step : (ends[0] + ends[1]) / 2 });
    }
  }

  /** Puts the scales where they do not stand in front of the flight. */
  update(camera: THREE.Camera): void {
    const middle = [(this.x[0] + this.x[1]) / 2, (this.y[0] + this.y[1]) / 2] as const;
    const nearX = camera.position.x > middle[0] ? 1 : 0;
    const nearY = camera.position.y > middle[1] ? 1 : 0;
    const corner = this.leftCorner(camera);
    this.post.position.set(corner.x, corner.y, 0);
    this.post.rotation.z = Math.atan2(camera.position.y - corner.y, camera.position.x - corner.x) + Math.PI / 2;
    const away = this.step * LABEL_OUT;
    const outX = nearX ? away : -away;
    const outY = nearY ? away : -away;
    const side = new THREE.Vector3(-1, 0, 0).applyQuaternion(camera.quaternion).setZ(0).normalize().multiplyScalar(0.35 * this.step);
    // The scale of an axis that points at the eye would be a heap of numbers.
    const forward = new THREE.Vector3(0, 0, -1).applyQuaternion(camera.quaternion);
    const endOn = { x: Math.abs(forward.x) > END_ON, y: Math.abs(forward.y) > END_ON, z: Math.abs(forward.z) > END_ON };
    this.post.visible = !endOn.z;
    const fromSide = Math.abs(forward.z) < Math.sqrt(1 - END_ON * END_ON);
    for (const { label, axis, value } of this.ticks) {
      label.offset = fromSide && axis !== "z" ? [0, label.rank === 2 ? SIDE_NAME_DOWN_PX : SIDE_DOWN_PX] : [0, 0];
      const name = label.rank === 2 ? 2.4 : 1;
      if (axis === "x") label.at.set(value, this.y[nearY]! + outY * name, this.z);
      else if (axis === "y") label.at.set(this.x[nearX]! + outX * name, value, this.z);
      else {
        label.at.set(corner.x, corner.y, value);
        if (label.rank !== 2) label.at.add(side);
      }
      label.shown = !endOn[axis];
    }
  }

  /** The corner seen farthest to the left. */
  private leftCorner(camera: THREE.Camera): THREE.Vector3 {
    const corners = this.x.flatMap((x) => this.y.map((y) => new THREE.Vector3(x, y, this.z)));
    const seen = corners.map((c) => c.clone().project(camera).x);
    return corners[seen.indexOf(Math.min(...seen))]!;
  }

  paint(theme: Theme): void {
    this.lines.material.color.set(theme.inks.gridStrong);
    this.lines.material.opacity = 0.55;
    this.edge.material.color.set(theme.inks.reference);
    this.edge.material.opacity = 0.8;
    this.post.material.color.set(theme.inks.reference);
  }
}

function range([from, to]: [number, number], step: number): number[] {
  return Array.from({ length: Math.round((to - from) / step) + 1 }, (_, i) => from + i * step);
}

function segments(positions: number[]): THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial> {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ transparent: true }));
}
