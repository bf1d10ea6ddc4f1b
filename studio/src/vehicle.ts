// One vehicle in the 3D view: hub, arms, rotors, a nose that shows the heading, and a bar of thrust on each rotor.
//
// The shape is in the body frame, metres; the group carries position, attitude and the display scale.

import * as THREE from "three";
import type { RigidBody, Run } from "./data";
import { bodyAxes, type Flight } from "./flight";
import type { Theme } from "./theme";

/** Parts of the vehicle, in arm lengths. */
const ROTOR_RADIUS = 0.4;
const ARM_RADIUS = 0.035;
const HUB_RADIUS = 0.17;
const BAR_RADIUS = 0.045;
const BAR_LENGTH = 0.9;
/** Bars are cut off here, in full thrusts; an unlimited controller may ask for much more. */
const BAR_MOST = 1.6;
const DIM = 0.22;

/** What a full bar stands for, per input: the largest limit of any run, else twice the usual input. */
export function fullThrust(runs: Run[], input: number): number {
  const limits = runs.flatMap((run) => run.input_limits[input]?.max ?? []);
  if (limits.length > 0) return Math.max(...limits);
  const values = runs.flatMap((run) => run.inputs[input]?.filter((v) => v !== null) ?? []).map(Math.abs).sort((a, b) => a - b);
  return 2 * (values[values.length >> 1] ?? 0.5) || 1;
}

export class Vehicle {
  readonly group = new THREE.Group();
  /** Where the vehicle is; the same vector as the group's position. */
  readonly position = this.group.position;
  private readonly frame = new THREE.MeshLambertMaterial();
  private readonly nose = new THREE.MeshLambertMaterial();
  private readonly rotorFill: THREE.MeshBasicMaterial[] = [];
  private readonly bars: THREE.Mesh<THREE.CylinderGeometry, THREE.MeshBasicMaterial>[] = [];
  private readonly shadow: THREE.Mesh<THREE.CircleGeometry, THREE.MeshBasicMaterial>;
  private readonly stem: THREE.Line<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  /** Stem and shadow: what ties the vehicle to the ground. */
  readonly footing = new THREE.Group();

  constructor(
    readonly flight: Flight,
    private readonly body: RigidBody,
    private readonly full: number[],
    private readonly groundZ: number,
    scale: number,
  ) {
    const arm = body.arm_length_m;
    const hub = new THREE.Mesh(new THREE.CylinderGeometry(arm * HUB_RADIUS, arm * HUB_RADIUS * 1.15, arm * 0.16, 20).rotateX(Math.PI / 2), this.frame);
    const nose = new THREE.Mesh(new THREE.ConeGeometry(arm * 0.1, arm * 0.3, 16).rotateZ(-Math.PI / 2).translate(arm * 0.3, 0, arm * 0.02), this.nose);
    this.group.add(hub, nose);
    body.rotors.forEach((rotor) => this.addRotor(new THREE.Vector3(...rotor), arm));
    this.group.scale.setScalar(scale);

    this.shadow = new THREE.Mesh(new THREE.CircleGeometry(arm * 0.45 * scale, 24), new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.28, depthWrite: false }));
    this.stem = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, 0, 1)]), new THREE.LineBasicMaterial({ transparent: true, opacity: 0.45 }));
    this.footing.add(this.shadow, this.stem);
  }

  private addRotor(at: THREE.Vector3, arm: number): void {
    const length = at.length();
    const bar = new THREE.CylinderGeometry(arm * ARM_RADIUS, arm * ARM_RADIUS, length, 10).translate(0, length / 2, 0);
    const armMesh = new THREE.Mesh(bar, this.frame);
    armMesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), at.clone().normalize());
    const ring = new THREE.Mesh(new THREE.TorusGeometry(arm * ROTOR_RADIUS, arm * 0.025, 8, 36), this.frame);
    const fill = new THREE.MeshBasicMaterial({ transparent: true, side: THREE.DoubleSide, depthWrite: false });
    const disc = new THREE.Mesh(new THREE.CircleGeometry(arm * ROTOR_RADIUS, 32), fill);
    const thrust = new THREE.Mesh(new THREE.CylinderGeometry(arm * BAR_RADIUS, arm * BAR_RADIUS, 1, 10).rotateX(Math.PI / 2).translate(0, 0, 0.5), new THREE.MeshBasicMaterial({ transparent: true }));
    const mount = new THREE.Group();
    mount.position.copy(at).z += arm * 0.06;
    mount.add(ring, disc, thrust);
    this.group.add(armMesh, mount);
    this.rotorFill.push(fill);
    this.bars.push(thrust);
  }

  /** Moves everything to time `t`. */
  update(t: number, theme: Theme): void {
    const { flight } = this;
    this.position.set(...flight.position(t));
    const { index, fraction } = flight.at(t);
    this.group.quaternion.copy(quaternion(flight, index)).slerp(quaternion(flight, index + 1), fraction);

    const drop = this.position.z - this.groundZ;
    this.footing.position.set(this.position.x, this.position.y, this.groundZ);
    this.stem.scale.z = drop;
    this.shadow.position.z = 0.002 * this.body.arm_length_m;

    const inputs = flight.inputs(t);
    this.bars.forEach((bar, i) => {
      const force = inputs[i] ?? 0;
      const share = Math.min(Math.max(force / this.full[i]!, -BAR_MOST), BAR_MOST);
      bar.scale.z = (Math.abs(share) < 0.01 ? 0.01 : share) * BAR_LENGTH * this.body.arm_length_m;
      const atLimit = this.isAtLimit(i, force);
      const color = atLimit ? theme.inks.saturated : theme.inks.body;
      bar.material.color.set(color);
      this.rotorFill[i]!.color.set(atLimit ? theme.inks.saturated : theme.color(flight.run));
    });
  }

  private isAtLimit(input: number, force: number): boolean {
    const limit = this.flight.run.input_limits[input];
    const slack = 1e-6 * this.full[input]!;
    return (limit?.max != null && force >= limit.max - slack) || (limit?.min != null && force <= limit.min + slack);
  }

  /** Colours, and whether another run is brought out. */
  paint(theme: Theme, dim: boolean): void {
    const color = theme.color(this.flight.run);
    for (const material of [this.frame, this.shadow.material, this.stem.material]) material.color.set(color);
    this.nose.color.set(theme.inks.body);
    for (const material of [this.frame, this.nose]) {
      material.transparent = dim;
      material.opacity = dim ? DIM : 1;
      material.needsUpdate = true;
    }
    for (const bar of this.bars) bar.material.opacity = dim ? DIM : 1;
    for (const fill of this.rotorFill) fill.opacity = dim ? 0.06 : 0.28;
    this.shadow.material.opacity = dim ? 0.06 : 0.28;
    this.stem.material.opacity = dim ? 0.12 : 0.5;
  }

  setVisible(visible: boolean): void {
    this.group.visible = visible;
    this.footing.visible = visible;
  }
}

function quaternion(flight: Flight, sample: number): THREE.Quaternion {
  const [x, y, z] = bodyAxes(...flight.attitude(sample));
  return new THREE.Quaternion().setFromRotationMatrix(new THREE.Matrix4().makeBasis(new THREE.Vector3(...x), new THREE.Vector3(...y), new THREE.Vector3(...z)));
}
