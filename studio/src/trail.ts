// The path of a run in the 3D view: flown so far (wide), still to come (thin and faint), a marker for every second,
// and a cross where the run ends before the others.

import * as THREE from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import type { Flight } from "./flight";
import { markerTexture } from "./sprite";
import { marker, type Theme } from "./theme";

const WIDTH_PX = 2.2;
const WIDTH_HIGHLIGHTED_PX = 3.6;
const MARKER_PX = 10;
const END_PX = 17;

export class Trail {
  readonly group = new THREE.Group();
  private readonly geometry = new LineGeometry();
  private readonly flown: Line2;
  private readonly flownMaterial = new LineMaterial({ linewidth: WIDTH_PX, worldUnits: false, transparent: true });
  private readonly whole: THREE.Line<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly marks: THREE.Points<THREE.BufferGeometry, THREE.PointsMaterial>;
  private readonly end: THREE.Points<THREE.BufferGeometry, THREE.PointsMaterial>;
  private readonly markTimes: number[] = [];
  private readonly segments: number;
  private bent = -1;

  constructor(
    private readonly flight: Flight,
    start_s: number,
    markEvery_s: number,
  ) {
    // A line needs two points; a flight of one sample becomes a line of no length.
    const points = flight.points.length > 1 ? flight.points : [flight.position(start_s), flight.position(start_s)];
    this.segments = points.length - 1;
    this.geometry.setPositions(points.flat());
    this.flown = new Line2(this.geometry, this.flownMaterial);
    this.flown.frustumCulled = false;
    const vectors = points.map((p) => new THREE.Vector3(...p));
    this.whole = new THREE.Line(new THREE.BufferGeometry().setFromPoints(vectors), new THREE.LineBasicMaterial({ transparent: true }));
    for (let t = start_s; t <= flight.endTime + 1e-9; t += markEvery_s) this.markTimes.push(t);
    this.marks = sprites(this.markTimes.map((t) => new THREE.Vector3(...flight.position(t))), MARKER_PX);
    this.end = sprites([vectors.at(-1)!], END_PX);
    this.end.renderOrder = 3;
    this.group.add(this.whole, this.flown, this.marks, this.end);
  }

  /** Draws the flown part up to time `t`, its last segment up to the vehicle. */
  update(t: number): void {
    const { index, fraction } = this.flight.at(t);
    const buffer = (this.geometry.attributes.instanceStart as THREE.InterleavedBufferAttribute).data;
    if (this.bent >= 0) this.setEnd(buffer, this.bent, this.flight.points[this.bent + 1]!);
    this.bent = -1;
    if (fraction > 0 && index < this.segments) {
      this.setEnd(buffer, index, this.flight.position(t));
      this.bent = index;
    }
    const count = Math.min(index + (fraction > 0 ? 1 : 0), this.segments);
    this.geometry.instanceCount = count;
    this.flown.visible = count > 0;
    this.marks.geometry.setDrawRange(0, this.markTimes.filter((m) => m <= t + 1e-9).length);
    this.end.visible = this.flight.ending !== "completed" && t >= this.flight.endTime;
  }

  private setEnd(buffer: THREE.InterleavedBuffer, segment: number, p: readonly number[]): void {
    (buffer.array as Float32Array).set(p, segment * 6 + 3);
    buffer.needsUpdate = true;
  }

  paint(theme: Theme, dim: boolean, highlighted: boolean): void {
    const color = theme.color(this.flight.run);
    this.flownMaterial.color.set(color);
    this.flownMaterial.opacity = dim ? 0.16 : 0.95;
    this.flownMaterial.linewidth = highlighted ? WIDTH_HIGHLIGHTED_PX : WIDTH_PX;
    this.whole.material.color.set(color);
    this.whole.material.opacity = dim ? 0.06 : highlighted ? 0.5 : 0.22;
    this.marks.material.map = markerTexture(marker(this.flight.run), color, theme.inks.panel);
    this.marks.material.opacity = dim ? 0.15 : 1;
    this.end.material.map = markerTexture("cross", color, theme.inks.panel);
    this.end.material.opacity = dim ? 0.2 : 1;
    for (const points of [this.marks, this.end]) points.material.needsUpdate = true;
  }
}

/** Points of a fixed size on the screen. */
function sprites(points: THREE.Vector3[], size_px: number): THREE.Points<THREE.BufferGeometry, THREE.PointsMaterial> {
  const material = new THREE.PointsMaterial({ size: size_px, sizeAttenuation: false, transparent: true, alphaTest: 0.1, depthWrite: false });
  const object = new THREE.Points(new THREE.BufferGeometry().setFromPoints(points), material);
  object.frustumCulled = false;
  object.renderOrder = 2;
  return object;
}
