// The 3D view: all vehicles on one set of set points, with what was flown so far.
// It draws only when something changed: the time, the camera, the selection, the theme or the size.

import * as THREE from "three";
import { letter, letterBadge } from "./badge";
import { Camera, type View } from "./camera";
import type { Report, RigidBody, Run } from "./data";
import { el, iconButton } from "./dom";
import { Flight, setPoints, viewBoxes } from "./flight";
import { fixed, seconds } from "./format";
import { Ground } from "./ground";
import { LabelLayer, type Label } from "./labels";
import type { Selection } from "./selection";
import { Targets } from "./targets";
import type { Theme } from "./theme";
import type { Timeline } from "./timeline";
import { Trail } from "./trail";
import { Triad } from "./triad";
import { fullThrust, Vehicle } from "./vehicle";

/** A vehicle spans at least this share of the picture; if to scale it would be less, it is drawn larger. */
const LEAST_SHARE = 1 / 7.5;
const SCALES = [1, 2, 3, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000];
const MARK_EVERY_S = [1, 2, 5, 10, 30, 60, 300, 600];
const MOST_MARKS = 120;
const CLICK_SLACK_PX = 5;
const PICK_RADIUS_PX = 36;

interface Flyer {
  run: Run;
  flight: Flight;
  vehicle: Vehicle;
  trail: Trail;
  label: Label;
  remark: HTMLElement;
}

/** The panel with tools, picture and status line; where there is no WebGL, one that says so. */
export function scenePanel(report: Report, body: RigidBody, timeline: Timeline, selection: Selection, theme: Theme): HTMLElement {
  let scene: Scene;
  try {
    scene = new Scene(report, body, timeline, selection, theme);
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    return el(
      "section",
      { class: "panel scene is-missing", id: "scene", "aria-label": "3D view" },
      el("div", { class: "scene-missing" }, el("b", {}, "No 3D view"), el("span", {}, "This browser offers no WebGL here. The table and the plots are complete without it."), el("small", {}, why)),
    );
  }
  return scene.element;
}

class Scene {
  readonly element: HTMLElement;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera: Camera;
  private readonly ground: Ground;
  private readonly targets: Targets;
  private readonly triad = new Triad();
  private readonly layer = new LabelLayer();
  private readonly flyers: Flyer[];
  private readonly view = el("div", { class: "scene-view" });
  private readonly follow = el("select", { id: "follow", "aria-label": "Follow with the camera" });
  private readonly time = el("b", { id: "scene-time" });
  private readonly pose = el("span", { id: "scene-pose", class: "scene-pose" });
  private readonly scale: number;
  private readonly markEvery_s: number;
  private width = 0;
  private height = 0;
  private queued = false;

  constructor(
    private readonly report: Report,
    private readonly body: RigidBody,
    private readonly timeline: Timeline,
    private readonly selection: Selection,
    private readonly theme: Theme,
  ) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `3D view of ${report.runs.length} vehicles; drag to turn, scroll to zoom once it has the focus`);

    const { fit, clip } = viewBoxes(report, body);
    const size = Math.hypot(...fit.high.map((h, i) => h - fit.low[i]!));
    const wanted = (size * LEAST_SHARE) / (2.8 * body.arm_length_m);
    this.scale = SCALES.findLast((s) => s <= wanted) ?? 1;
    const length = timeline.end - timeline.start;
    this.markEvery_s = MARK_EVERY_S.find((s) => length / s <= MOST_MARKS) ?? 3600;

    this.ground = new Ground(fit, this.layer);
    this.camera = new Camera(this.ground.box, canvas, () => this.requestDraw());
    this.targets = new Targets(setPoints(report, body), this.ground.z, Math.max(0.8 * body.arm_length_m * this.scale, 0.012 * size), this.layer);
    const full = report.plant.inputs.map((_, i) => fullThrust(report.runs, i));
    this.flyers = report.runs.map((run) => this.flyer(run, new Flight(report, body, run, clip), full));

    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(-1, -2, 4);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa4b2, 2.1), sun, this.ground.group, this.targets.group);
    for (const f of this.flyers) this.scene.add(f.vehicle.group, f.vehicle.footing, f.trail.group);

    this.view.append(canvas, this.layer.element, this.triad.element);
    this.element = el("section", { class: "panel scene", id: "scene", "aria-label": "3D view" }, this.tools(), this.view, this.status());
    this.listen(canvas);
  }

  private flyer(run: Run, flight: Flight, full: number[]): Flyer {
    const vehicle = new Vehicle(flight, this.body, full, this.ground.z, this.scale);
    const remark = el("small", { hidden: true });
    const element = el("span", { class: "vehicle-label" }, letterBadge(this.report, run, this.theme), remark);
    const label = this.layer.add(element, 0, [0, -24], vehicle.position);
    return { run, flight, vehicle, trail: new Trail(flight, this.timeline.start, this.markEvery_s), label, remark };
  }

  private tools(): HTMLElement {
    const views: [View, string, string][] = [
      ["perspective", "3D", "From the side and above: the whole flight"],
      ["top", "Top", "From above: x to the right, y up"],
      ["xz", "x–z", "From the side: x to the right, z up"],
      ["yz", "y–z", "Along x: y to the right, z up"],
    ];
    const look = (view: View): void => {
      this.camera.look(view);
      this.requestDraw();
    };
    const reset = (): void => {
      this.setFollowed("");
      look("perspective");
    };
    this.follow.append(el("option", { value: "" }, "nobody"), ...this.report.runs.map((run) => el("option", { value: run.id }, `${letter(this.report, run)}: ${run.label}`)));
    this.follow.addEventListener("change", () => this.setFollowed(this.follow.value));
    const zoom = (inwards: boolean) => () => {
      this.camera.zoom(inwards);
      this.requestDraw();
    };
    return el(
      "div",
      { class: "scene-tools" },
      el("div", { class: "segmented", role: "group", "aria-label": "View" }, ...views.map(([view, name, title]) => el("button", { type: "button", "data-view": view, title, onclick: () => look(view) }, name))),
      el("label", {}, "Follow", this.follow),
      el("span", { class: "spacer" }),
      iconButton("Zoom in", "M12 6v12M6 12h12", zoom(true)),
      iconButton("Zoom out", "M6 12h12", zoom(false)),
      iconButton("Reset view", "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5", reset),
    );
  }

  private setFollowed(id: string): void {
    const flyer = this.flyers.find((f) => f.run.id === id);
    this.follow.value = id;
    this.selection.select(flyer?.run ?? null);
    this.camera.follow(flyer?.vehicle.position ?? null);
    this.requestDraw();
  }

  private status(): HTMLElement {
    const key = (ink: "body" | "saturated", text: string): HTMLElement => {
      const swatch = el("span", { class: "swatch" });
      const paint = (): void => void (swatch.style.background = this.theme.inks[ink]);
      paint();
      this.theme.changed.listen(paint);
      return el("span", { class: "key" }, swatch, text);
    };
    const scale = this.scale === 1 ? "vehicles to scale" : `vehicles ×${this.scale}`;
    return el(
      "div",
      { class: "scene-status" },
      el("span", { class: "scene-time" }, this.time),
      el("span", { id: "scene-scale" }, scale),
      el("span", {}, `grid ${this.ground.step} m`),
      el("span", {}, `a mark every ${this.markEvery_s === 1 ? "second" : `${this.markEvery_s} s`}`),
      key("body", "thrust"),
      key("saturated", "thrust at a limit"),
      this.pose,
    );
  }

  private listen(canvas: HTMLCanvasElement): void {
    new ResizeObserver(() => this.resize()).observe(this.view);
    this.timeline.changed.listen(() => this.requestDraw());
    this.selection.changed.listen(() => {
      const followed = this.flyers.find((f) => f.run.id === this.follow.value);
      if (followed && !this.selection.isVisible(followed.run)) this.setFollowed("");
      this.paint();
      this.requestDraw();
    });
    this.theme.changed.listen(() => {
      this.paint();
      this.requestDraw();
    });
    let down: [number, number] | null = null;
    canvas.addEventListener("pointerdown", (e) => (down = [e.clientX, e.clientY]));
    canvas.addEventListener("pointerup", (e) => {
      if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < CLICK_SLACK_PX) this.pick(e);
      down = null;
    });
    this.paint();
  }

  /** A click picks the vehicle that is seen nearest to it. */
  private pick(event: PointerEvent): void {
    const box = this.view.getBoundingClientRect();
    let best: Run | null = null;
    let bestDistance = PICK_RADIUS_PX;
    for (const { run, vehicle } of this.flyers) {
      if (!this.selection.isVisible(run)) continue;
      const p = vehicle.position.clone().project(this.camera.camera);
      const distance = Math.hypot(((p.x + 1) / 2) * this.width - (event.clientX - box.left), ((1 - p.y) / 2) * this.height - (event.clientY - box.top));
      if (distance < bestDistance) [best, bestDistance] = [run, distance];
    }
    if (best) this.selection.toggleSelected(best);
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.view;
    if (clientWidth === 0 || clientHeight === 0) return;
    [this.width, this.height] = [clientWidth, clientHeight];
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.resize(clientWidth, clientHeight);
    this.draw();
  }

  /** Colours, visibility and emphasis. */
  private paint(): void {
    const { highlighted } = this.selection;
    for (const { run, vehicle, trail, label } of this.flyers) {
      const visible = this.selection.isVisible(run);
      const dim = highlighted !== null && highlighted !== run;
      vehicle.setVisible(visible);
      trail.group.visible = visible;
      label.shown = visible;
      label.element.classList.toggle("is-dim", dim);
      vehicle.paint(this.theme, dim);
      trail.paint(this.theme, dim, highlighted === run);
    }
    this.ground.paint(this.theme);
    this.targets.paint(this.theme);
    this.triad.paint(this.theme);
  }

  private requestDraw(): void {
    if (this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    this.queued = false;
    if (this.width === 0) return;
    const t = this.timeline.now;
    for (const { vehicle, trail, flight, run, remark } of this.flyers) {
      vehicle.update(t, this.theme);
      trail.update(t);
      const ended = flight.ending !== "completed" && t >= flight.endTime;
      const text = !ended || run.outcome.kind !== "diverged" ? "" : flight.ending === "diverged" || t >= run.outcome.time_s ? `diverged ${seconds(run.outcome.time_s, 1)}` : "out of view";
      if (remark.textContent !== text) remark.textContent = text;
      remark.hidden = text === "";
    }
    this.targets.update(t);
    this.camera.update();
    const { camera } = this.camera;
    camera.updateMatrixWorld();
    this.ground.update(camera);
    this.triad.update(camera);
    this.renderer.render(this.scene, camera);
    this.layer.update(camera, this.width, this.height);
    this.time.textContent = `t = ${seconds(t)}`;
    this.pose.textContent = this.describe(t);
  }

  /** Where the highlighted vehicle is. */
  private describe(t: number): string {
    const flyer = this.flyers.find((f) => f.run === this.selection.highlighted);
    if (!flyer) return "";
    const [x, y, z] = flyer.flight.position(t);
    const yaw = (flyer.flight.attitude(flyer.flight.at(t).index)[2] * 180) / Math.PI;
    return `${letter(this.report, flyer.run)}: x ${fixed(x, 2)}, y ${fixed(y, 2)}, z ${fixed(z, 2)} m, yaw ${fixed(yaw, 0)}°`;
  }
}
