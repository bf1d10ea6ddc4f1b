// The set points in the 3D view: a cross-hair in space with its number and a line that points along the yaw.

import * as THREE from "three";
import { el } from "./dom";
import type { SetPoint } from "./flight";
import type { LabelLayer } from "./labels";
import type { Theme } from "./theme";

export class Targets {
  readonly group = new THREE.Group();
  private readonly solid = new THREE.LineBasicMaterial();
  private readonly dashed = new THREE.LineDashedMaterial({ transparent: true, opacity: 0.7 });
  private readonly marks: { point: SetPoint; object: THREE.Object3D; element: HTMLElement }[] = [];

  constructor(points: SetPoint[], groundZ: number, size: number, layer: LabelLayer) {
    this.dashed.dashSize = size * 0.4;
    this.dashed.gapSize = size * 0.4;
    points.forEach((point, i) => {
      const at = new THREE.Vector3(...point.position);
      const object = new THREE.Group();
      const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap(([x, y, z]) => [new THREE.Vector3(-x!, -y!, -z!), new THREE.Vector3(x, y, z)].map((v) => v.multiplyScalar(size * 0.55)));
      object.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(axes), this.solid));
      const ring = Array.from({ length: 49 }, (_, k) => new THREE.Vector3(Math.cos((k * Math.PI) / 24), Math.sin((k * Math.PI) / 24), 0).multiplyScalar(size));
      object.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(ring), this.solid));
      const heading = [1, 1.7, 1.45, 1.7, 1.45].map((r, k) => new THREE.Vector3(r * size, [0, 0, 0.16, 0, -0.16][k]! * size, 0));
      const arrow = new THREE.Line(new THREE.BufferGeometry().setFromPoints(heading), this.solid);
      arrow.rotation.z = point.yaw_rad;
      object.add(arrow);
      object.position.copy(at);
      const stem = new THREE.Line(new THREE.BufferGeometry().setFromPoints([at, new THREE.Vector3(at.x, at.y, groundZ)]), this.dashed);
      stem.computeLineDistances();
      this.group.add(object, stem);
      const element = el("span", { class: "setpoint-label" }, String(i));
      layer.add(element, 1, [0, 16], at);
      this.marks.push({ point, object, element });
    });
  }

  /** The set point that holds at `t` stands out. */
  update(t: number): void {
    const current = this.marks.findLast((m) => m.point.time_s <= t + 1e-9);
    for (const mark of this.marks) {
      mark.object.scale.setScalar(mark === current ? 1.35 : 0.9);
      mark.element.style.opacity = mark === current ? "1" : "0.65";
    }
  }

  paint(theme: Theme): void {
    this.solid.color.set(theme.inks.muted);
    this.dashed.color.set(theme.inks.reference);
  }
}
