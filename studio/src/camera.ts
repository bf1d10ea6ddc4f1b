// The camera: orbits with pointer and touch, fits the flight, looks along axes, follows a vehicle.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Box } from "./flight";

export type View = "perspective" | "top" | "xz" | "yz";

/** From where each view looks. Top is tilted by a hair, so that "up" is defined. */
const FROM: Record<View, [number, number, number]> = {
  perspective: [-0.55, -0.72, 0.45],
  top: [0, -0.0005, 1],
  xz: [0, -1, 0.0005],
  yz: [1, 0, 0.0005],
};

const FIELD_OF_VIEW_DEG = 32;
/** Looking along an axis, from so far away that heights do not shift against the grid. */
const FLAT_FIELD_OF_VIEW_DEG = 2;
const ZOOM_STEP = 1.25;
const FOLLOW_DISTANCE = 0.45;
/** Space around the fitted box. */
const FIT_MARGIN = 1.12;
const FIT_ROUNDS = 6;

export class Camera {
  readonly camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 1000);
  readonly controls: OrbitControls;
  private readonly center = new THREE.Vector3();
  private readonly corners: THREE.Vector3[];
  private view: View = "perspective";
  private touched = false;
  private followed: THREE.Vector3 | null = null;

  constructor(box: Box, canvas: HTMLCanvasElement, onchange: () => void) {
    this.camera.up.set(0, 0, 1);
    this.corners = [box.low[0], box.high[0]].flatMap((x) => [box.low[1], box.high[1]].flatMap((y) => [box.low[2], box.high[2]].map((z) => new THREE.Vector3(x, y, z))));
    this.center.set((box.low[0] + box.high[0]) / 2, (box.low[1] + box.high[1]) / 2, (box.low[2] + box.high[2]) / 2);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", onchange);
    this.controls.addEventListener("start", () => (this.touched = true));
    // A finger that moves up or down scrolls the page; the wheel zooms once the view has the focus.
    canvas.style.touchAction = "pan-y";
    this.controls.enableZoom = false;
    canvas.addEventListener("focus", () => (this.controls.enableZoom = true));
    canvas.addEventListener("blur", () => (this.controls.enableZoom = false));
    canvas.addEventListener("touchstart", (event) => (this.controls.enableZoom = event.touches.length > 1 || document.activeElement === canvas), { passive: true });
  }

  /** Shows the whole flight from one side, or the followed vehicle from nearer by. */
  look(view: View): void {
    this.view = view;
    this.touched = false;
    this.camera.fov = view === "perspective" ? FIELD_OF_VIEW_DEG : FLAT_FIELD_OF_VIEW_DEG;
    const from = new THREE.Vector3(...FROM[view]);
    // An upright picture has more room for the ground when it is seen from higher up.
    if (view === "perspective" && this.camera.aspect < 1) from.z *= 1.5;
    from.normalize();
    const { distance, target } = this.fit(from);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(from, distance);
    this.camera.near = distance / 200;
    this.camera.far = distance * 30;
    this.controls.minDistance = distance / 60;
    this.controls.maxDistance = distance * 8;
    this.camera.updateProjectionMatrix();
    if (this.followed) this.approach(this.followed);
    this.controls.update();
  }

  /** The panel changed its shape: fit again, unless the user has moved the camera. */
  resize(width: number, height: number): void {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.touched && !this.followed) this.look(this.view);
  }

  zoom(inwards: boolean): void {
    this.touched = true;
    const arm = this.camera.position.clone().sub(this.controls.target);
    const length = THREE.MathUtils.clamp(arm.length() * (inwards ? 1 / ZOOM_STEP : ZOOM_STEP), this.controls.minDistance, this.controls.maxDistance);
    this.camera.position.copy(this.controls.target).add(arm.setLength(length));
    this.controls.update();
  }

  /** Keeps `target`, a vector that moves, in the middle; null lets go and shows the whole flight again. */
  follow(target: THREE.Vector3 | null): void {
    if (target === this.followed) return;
    this.followed = target;
    if (!target) this.look(this.view);
    else this.approach(target);
    this.controls.update();
  }

  /** Looks at `target` from the same side, from nearer by. */
  private approach(target: THREE.Vector3): void {
    const arm = this.camera.position.clone().sub(this.controls.target);
    const near = this.fit(arm.clone().normalize()).distance * FOLLOW_DISTANCE;
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(arm.setLength(Math.min(arm.length(), near)));
  }

  /** Moves along with the followed vehicle. */
  update(): void {
    if (!this.followed) return;
    const move = this.followed.clone().sub(this.controls.target);
    if (move.lengthSq() === 0) return;
    this.controls.target.add(move);
    this.camera.position.add(move);
    this.controls.update();
  }

  /** The least distance along `from` at which the whole box is inside the picture, and the point to look at. */
  private fit(from: THREE.Vector3): { distance: number; target: THREE.Vector3 } {
    const forward = from.clone().negate();
    const right = forward.clone().cross(this.camera.up).normalize();
    const up = right.clone().cross(forward);
    const tanY = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2)) / FIT_MARGIN;
    const tanX = tanY * this.camera.aspect;
    const target = this.center.clone();
    let distance = 0;
    // Near corners look larger, so the box's centre is not the picture's: shift until it is.
    for (let round = 0; round < FIT_ROUNDS; round++) {
      const relative = this.corners.map((c) => c.clone().sub(target));
      distance = Math.max(...relative.map((v) => Math.max(Math.abs(v.dot(right)) / tanX, Math.abs(v.dot(up)) / tanY) - v.dot(forward)));
      const seen = relative.map((v) => [v.dot(right) / (distance + v.dot(forward)), v.dot(up) / (distance + v.dot(forward))] as const);
      const middle = (k: 0 | 1): number => (Math.min(...seen.map((p) => p[k])) + Math.max(...seen.map((p) => p[k]))) / 2;
      target.addScaledVector(right, middle(0) * distance).addScaledVector(up, middle(1) * distance);
    }
    return { distance, target };
  }
}
