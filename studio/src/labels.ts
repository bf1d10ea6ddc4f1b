// Words in the 3D view: HTML on top of the canvas, moved to where points of the scene are seen.
// A label that would cover one that counts more is moved aside (vehicles) or left out (the rest).

import * as THREE from "three";

export interface Label {
  element: HTMLElement;
  at: THREE.Vector3;
  /** Lower counts more. Up to `MOVED_RANK` a label is moved aside rather than left out. */
  rank: number;
  shown: boolean;
  /** From the point's place on the screen to the label's centre, pixels. */
  offset: [number, number];
}

interface Rect {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

const MOVED_RANK = 1;
const GAP_PX = 2;
const TRIES = 40;

export class LabelLayer {
  readonly element = document.createElement("div");
  private readonly labels: Label[] = [];
  private readonly sizes = new Map<HTMLElement, { text: string; width: number; height: number }>();
  private readonly seen = new THREE.Vector3();

  constructor() {
    this.element.className = "scene-labels";
    this.element.setAttribute("aria-hidden", "true");
  }

  add(element: HTMLElement, rank: number, offset: [number, number] = [0, 0], at = new THREE.Vector3()): Label {
    const label: Label = { element, at, rank, shown: true, offset };
    this.element.append(element);
    this.labels.push(label);
    this.labels.sort((a, b) => a.rank - b.rank);
    return label;
  }

  update(camera: THREE.Camera, width: number, height: number): void {
    const placed: Rect[] = [];
    for (const label of this.labels) {
      const point = this.seen.copy(label.at).project(camera);
      let visible = label.shown && point.z < 1 && Math.abs(point.x) < 1.05 && Math.abs(point.y) < 1.05;
      if (visible) {
        const size = this.size(label.element);
        const movable = label.rank <= MOVED_RANK;
        const free = { x: ((point.x + 1) / 2) * width + label.offset[0], y: ((1 - point.y) / 2) * height + label.offset[1] };
        const x = movable ? clamp(free.x, size.width / 2, width - size.width / 2) : free.x;
        const y = movable ? clamp(free.y, size.height / 2, height - size.height / 2) : free.y;
        const rect = this.place(x, y, size, placed, movable);
        visible = rect !== null && rect.left >= 0 && rect.right <= width && rect.top >= 0 && rect.bottom <= height;
        if (rect && visible) {
          placed.push(rect);
          label.element.style.transform = `translate(${rect.left.toFixed(1)}px, ${rect.top.toFixed(1)}px)`;
        }
      }
      label.element.style.visibility = visible ? "visible" : "hidden";
    }
  }

  /** A free place at, or for labels that may move to the right of, the wanted one. */
  private place(x: number, y: number, size: { width: number; height: number }, placed: Rect[], movable: boolean): Rect | null {
    let left = x - size.width / 2;
    const top = y - size.height / 2;
    for (let i = 0; i < (movable ? TRIES : 1); i++) {
      const rect = { left, top, right: left + size.width, bottom: top + size.height };
      const hit = placed.find((p) => rect.left < p.right + GAP_PX && rect.right > p.left - GAP_PX && rect.top < p.bottom + GAP_PX && rect.bottom > p.top - GAP_PX);
      if (!hit) return rect;
      left = hit.right + GAP_PX + 0.5;
    }
    return null;
  }

  /** The label's size, measured anew only when its text changed: measuring is slow. */
  private size(element: HTMLElement): { width: number; height: number } {
    const text = element.textContent ?? "";
    const known = this.sizes.get(element);
    if (known && known.text === text && known.width > 0) return known;
    const size = { text, width: element.offsetWidth, height: element.offsetHeight };
    this.sizes.set(element, size);
    return size;
  }
}

function clamp(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}
