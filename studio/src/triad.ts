// The little axes in the corner of the 3D view: which way x, y and z point.

import * as THREE from "three";
import { svg } from "./dom";
import type { Theme } from "./theme";

const SIZE = 76;
const LENGTH = 25;

export class Triad {
  readonly element: SVGElement;
  private readonly axes: { direction: THREE.Vector3; line: SVGElement; text: SVGElement; ink: "axisX" | "axisY" | "axisZ" }[];

  constructor() {
    this.axes = (["x", "y", "z"] as const).map((name, i) => {
      const text = svg("text", { "text-anchor": "middle", "dominant-baseline": "central", "font-size": 12, "font-style": "italic", "font-weight": 600 });
      text.textContent = name;
      const ink = (["axisX", "axisY", "axisZ"] as const)[i]!;
      return { direction: new THREE.Vector3().setComponent(i, 1), line: svg("line", { x1: 0, y1: 0, "stroke-width": 2.2, "stroke-linecap": "round" }), text, ink };
    });
    this.element = svg("svg", { class: "triad", viewBox: `${-SIZE / 2} ${-SIZE / 2} ${SIZE} ${SIZE}`, width: SIZE, height: SIZE, "aria-hidden": "true" }, ...this.axes.flatMap((a) => [a.line, a.text]));
  }

  update(camera: THREE.Camera): void {
    const camera_from_earth = camera.quaternion.clone().invert();
    for (const { direction, line, text } of this.axes) {
      const seen = direction.clone().applyQuaternion(camera_from_earth);
      line.setAttribute("x2", (seen.x * LENGTH).toFixed(1));
      line.setAttribute("y2", (-seen.y * LENGTH).toFixed(1));
      const short = Math.hypot(seen.x, seen.y) < 0.2;
      text.setAttribute("x", (seen.x * (LENGTH + 8)).toFixed(1));
      text.setAttribute("y", (-seen.y * (LENGTH + 8)).toFixed(1));
      text.setAttribute("opacity", short ? "0" : "1");
      line.setAttribute("opacity", short ? "0.3" : "1");
    }
  }

  paint(theme: Theme): void {
    for (const { line, text, ink } of this.axes) {
      line.setAttribute("stroke", theme.inks[ink]);
      text.setAttribute("fill", theme.inks[ink]);
    }
  }
}
