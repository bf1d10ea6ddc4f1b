// A report with plausible data, for looking at the page and testing it without the program.
//
// A quadrotor is flown with the yaw-scheduled LQR gain; the seven runs differ in their limits, in how fast the set
// point is fed to the controller, and in noise. The costs and bounds are of the right kind, not right.

import { claimsOf } from "./claims.mjs";

const MASS = 2, GRAVITY = 9.807, IX = 1.25, IY = 1.25, IZ = 2.5, ARM = 0.3, DRAG = 0.075;
const HOVER = (MASS * GRAVITY) / 4;
const STEP_S = 0.005;
const EVERY = 6;

/** A small seeded generator (mulberry32) and a normal deviate made of it. */
function randomStream(seed) {
  let state = seed >>> 0;
  const uniform = () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
  return () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
}

function derivative(x, F) {
  const [vx, vy, vz, , , , p, q, r, phi, theta, psi] = x;
  const sum = F[0] + F[1] + F[2] + F[3];
  const [sf, cf, st, ct, sp, cp] = [Math.sin(phi), Math.cos(phi), Math.sin(theta), Math.cos(theta), Math.sin(psi), Math.cos(psi)];
  return [
    (st * sum) / MASS, (-sf * ct * sum) / MASS, (cf * ct * sum) / MASS - GRAVITY, vx, vy, vz,
    (ARM * (F[1] - F[3])) / IX - (q * r * (IZ - IY)) / IX, (ARM * (F[2] - F[0])) / IY - (p * r * (IX - IZ)) / IY,
    (DRAG * (F[0] + F[2] - F[1] - F[3])) / IZ - (p * q * (IY - IX)) / IZ,
    (p * cp - q * sp) / ct, p * sp + q * cp, ((q * sp - p * cp) * st) / ct + r,
  ];
}

/** K(ψ) of the yaw-scheduled LQR, u = −Kx. */
function gain(psi) {
  const s = Math.sin(psi), c = Math.cos(psi);
  const v = 47.7494, r = 22.3607, a = 390.4586, w = 163.1777, z = 123.0254, y = 158.1147;
  return [
    [-v * c, -v * s, 158.4679, -r * c, -r * s, 111.8035, 0, -w, z, a * s, -a * c, y],
    [v * s, -v * c, 158.4679, r * s, -r * c, 111.8035, w, 0, -z, a * c, a * s, -y],
    [v * c, v * s, 158.4679, r * c, r * s, 111.8035, 0, w, z, -a * s, a * c, y],
    [-v * s, v * c, 158.4679, -r * s, r * c, 111.8035, -w, 0, -z, -a * c, -a * s, -y],
  ];
}

const Q = [1, 1, 100, 1, 1, 50, 50, 50, 50, 1, 1, 100];
const R = 0.001;
const STEPS = [
  { time_s: 1, position: [6, 6, 6], yaw: Math.PI, label: "x = y = z = 6 m, yaw 180°" },
  { time_s: 16, position: [6, 0, 3], yaw: Math.PI / 2, label: "y = 0 m, z = 3 m, yaw 90°" },
  { time_s: 30, position: [0, 0, 4], yaw: 0, label: "x = 0 m, z = 4 m, yaw 0°" },
];

function referenceAt(t, steps) {
  const step = steps.filter((s) => s.time_s <= t + 1e-9).at(-1);
  return step ? [...step.position, step.yaw] : [0, 0, 0, 0];
}

function fly({ limits, lag_s, noise, duration_s, seed, steps }) {
  const gauss = randomStream(seed);
  let x = Array(12).fill(0);
  let fed = [0, 0, 0, 0];
  let cost = 0;
  const rows = [];
  const samples = Math.round(duration_s / STEP_S);
  for (let k = 0; k <= samples; k++) {
    const t = k * STEP_S;
    const target = referenceAt(t, steps);
    fed = fed.map((v, i) => v + (target[i] - v) * (lag_s > 0 ? 1 - Math.exp(-STEP_S / lag_s) : 1));
    const K = gain(x[11]);
    const error = x.map((v, i) => v - (i >= 3 && i < 6 ? fed[i - 3] : i === 11 ? fed[3] : 0) + noise * [0.026, 0.026, 0.06, 0.009, 0.009, 0.014, 0.03, 0.03, 0.012, 0.0094, 0.0097, 0.0065][i] * gauss() * 0.3);
    const F = K.map((row) => {
      const force = HOVER - row.reduce((sum, gainValue, i) => sum + gainValue * error[i], 0);
      return limits ? Math.min(Math.max(force, limits[0]), limits[1]) : force;
    });
    const wanted = x.map((v, i) => v - (i >= 3 && i < 6 ? target[i - 3] : i === 11 ? target[3] : 0));
    cost += STEP_S * (wanted.reduce((s, v, i) => s + Q[i] * v * v, 0) + R * F.reduce((s, f) => s + (f - HOVER) ** 2, 0));
    if (x.some((v) => !(Math.abs(v) < 13 * Math.max(1, ...steps.map((s) => s.position[0] / 6)))) || Math.abs(x[10]) > 1.55) return { rows, diverged: t };
    if (k % EVERY === 0) rows.push({ t, x, F, cost });
    const shove = F.map((f) => f + noise * 0.2 * gauss());
    const k1 = derivative(x, shove);
    const k2 = derivative(x.map((v, i) => v + (STEP_S / 2) * k1[i]), shove);
    const k3 = derivative(x.map((v, i) => v + (STEP_S / 2) * k2[i]), shove);
    const k4 = derivative(x.map((v, i) => v + STEP_S * k3[i]), shove);
    x = x.map((v, i) => v + (STEP_S / 6) * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]));
  }
  return { rows, diverged: null };
}

/** A divergence as a scenario may have it: off to a million metres before anybody stops it. */
function flyOff(flight, time) {
  let [x, y, z] = flight.rows.at(-1)?.x.slice(3, 6) ?? [0, 0, 0];
  const end = Math.min(time.length, flight.rows.length + 120);
  for (let i = flight.rows.length; i < end; i++) {
    const last = flight.rows.at(-1);
    [x, y, z] = [x * 1.11 + 0.2, y * 1.1 - 0.3, z - 0.4 * (i % 7)];
    flight.rows.push({ ...last, t: time[i], x: last.x.map((v, k) => (k === 3 ? x : k === 4 ? y : k === 5 ? z : v)), cost: last.cost * 1.1 });
  }
}

const CHANNELS = { v: "m/s", r: "m", w: "rad/s", a: "rad" };
const STATES = [["v_x", "v"], ["v_y", "v"], ["v_z", "v"], ["r_x", "r"], ["r_y", "r"], ["r_z", "r"], ["p", "w"], ["q", "w"], ["r", "w"], ["φ", "a"], ["θ", "a"], ["ψ", "a"]].map(([name, kind]) => ({ name, unit: CHANNELS[kind] }));
const WEIGHTS = [(p) => (1 - Math.cos(p)) * (1 - Math.sin(p)), (p) => (1 - Math.cos(p)) * (1 + Math.sin(p)), (p) => (1 + Math.cos(p)) * (1 - Math.sin(p)), (p) => (1 + Math.cos(p)) * (1 + Math.sin(p))];

const half = [0, 2 * HOVER];
const FLIGHTS = [
  { id: "lpvqr", label: "LPVQR, unbounded", controller: "LPVQR by Riccati equation at each of 32 yaws, interpolated", limits: null, lag_s: 0, verdict: "numerical", bound: 391.8 },
  { id: "lpvqr-limited", label: "LPVQR, 0 to mg/2", controller: "the same gains with forces limited to 0 … 9.81 N", limits: half, lag_s: 0, verdict: "refuted", bound: null },
  { id: "slpvqr-1", label: "SLPVQR γ = 1", controller: "saturated LPVQR, σ = mg/4, γ = 1, 32 yaws", limits: half, lag_s: 0.9, verdict: "numerical", bound: 1012.4 },
  { id: "slpvqr-10", label: "SLPVQR γ = 10", controller: "saturated LPVQR, σ = mg/4, γ = 10, 32 yaws", limits: half, lag_s: 1.6, verdict: "numerical", bound: 2210.7 },
  { id: "slpvqr-20", label: "SLPVQR γ = 20", controller: "saturated LPVQR, σ = mg/4, γ = 20, 32 yaws", limits: half, lag_s: 2.4, verdict: "proved", bound: 3540.12 },
  { id: "high-gain", label: "High gain γ = 20", controller: "high-gain saturated LPVQR, σ = mg/4, γ = 20, s = 0.01", limits: half, lag_s: 0.55, verdict: "undecided", bound: 3540.12 },
  { id: "high-gain-ekf", label: "High gain + EKF", controller: "the same, on the estimate of an extended Kalman filter, T = 2 ms", limits: half, lag_s: 0.65, noise: 1, verdict: "numerical", bound: null },
];

/** Builds the report; without a `parameter` the plant has none. The options make the odd cases. */
export function makeReport({ duration_s = 45, runs = FLIGHTS, scale = 1, scene = true, estimation = true, parameter = "psi" } = {}) {
  const steps = STEPS.map((s) => ({ ...s, position: s.position.map((v) => v * scale) })).filter((s) => s.time_s < duration_s);
  const count = Math.floor(Math.round(duration_s / STEP_S) / EVERY) + 1;
  const time = Array.from({ length: count }, (_, i) => Number((i * EVERY * STEP_S).toFixed(4)));
  const reference = STATES.map((_, i) => (i >= 3 && i < 6 ? time.map((t) => referenceAt(t, steps)[i - 3]) : i === 11 ? time.map((t) => referenceAt(t, steps)[3]) : i >= 9 ? time.map(() => 0) : null));
  return {
    schema: "lpv-report/1",
    title: "Quadrotor with saturated rotors",
    scenario: "quadrotor",
    description: "Seven controllers fly the same set points on the nonlinear plant, forces limited to 0 … mg/2 per rotor, the last one on noisy measurements.",
    version: "0.1.0",
    seed: 20,
    sample_time_s: 0.002,
    plant: {
      name: "quadrotor",
      states: STATES,
      inputs: [1, 2, 3, 4].map((i) => ({ name: `F_${i}`, unit: "N" })),
      outputs: [3, 4, 5, 9, 10, 11].map((i) => STATES[i]),
      linear: false,
      scene: scene ? { kind: "rigid-body", position: [3, 4, 5], euler_xyz: [9, 10, 11], arm_length_m: ARM, rotors: [[ARM, 0, 0], [0, ARM, 0], [-ARM, 0, 0], [0, -ARM, 0]] } : null,
    },
    scheduling: { parameter, unit: parameter === "" ? "" : "rad", weights: ["rho_1", "rho_2", "rho_3", "rho_4"] },
    time,
    reference,
    steps: steps.map(({ time_s, label }) => ({ time_s, label })),
    runs: runs.map((spec, index) => makeRun(spec, index, { time, duration_s, steps, estimation })),
    notes: [
      "Step 1 of LPVQR, 0 to mg/2 starts outside the certified ellipsoid: x'P x = 214.7 > γ = 1. A γ of 215 would cover it.",
      "The guaranteed costs are those of frozen-parameter designs: they bound the cost only while the yaw does not move.",
    ],
  };
}

function makeRun(spec, index, { time, duration_s, steps, estimation }) {
  const noise = spec.noise ?? 0;
  const flight = fly({ ...spec, noise, duration_s, seed: 7 + index, steps });
  if (flight.diverged !== null) flyOff(flight, time);
  const last = flight.rows.at(-1);
  const at = (pick) => time.map((_, k) => (flight.rows[k] ? Number(pick(flight.rows[k]).toPrecision(7)) : null));
  const gauss = randomStream(99 + index);
  const sigma = [0.026, 0.026, 0.1, 0.009, 0.009, 0.014, 0.042, 0.042, 0.012, 0.0094, 0.0097, 0.0065];
  const rise = (k, s) => s * Math.sqrt(1 - Math.exp(-time[k] / 0.8));
  const walk = sigma.map(() => 0);
  const error = sigma.map((s, i) => time.map((_, k) => ((walk[i] = 0.9 * walk[i] + Math.sqrt(1 - 0.81) * gauss()), walk[i] * rise(k, s))));
  const sigma3 = sigma.map((s) => time.map((_, k) => 3 * rise(k, s)));
  const forces = flight.rows.flatMap((r) => r.F);
  const atLimit = flight.rows.filter((r) => spec.limits && r.F.some((f) => f <= spec.limits[0] + 1e-9 || f >= spec.limits[1] - 1e-9)).length;
  return {
    id: spec.id,
    label: spec.label,
    color_index: index,
    controller: spec.controller,
    verdict: spec.verdict,
    guaranteed_cost_verdict: spec.verdict,
    ...claimsOf(spec),
    outcome: flight.diverged === null ? { kind: "completed" } : { kind: "diverged", time_s: last.t, state: "θ", detail: "|θ| reached 90°: the Euler angles have no meaning beyond." },
    guaranteed_cost: spec.guaranteed ? spec.bound : null,
    plant_cost_bound: null,
    model_cost_bound: spec.guaranteed ? null : spec.bound,
    guaranteed_cost_of: spec.guaranteed ? "plant" : "model",
    guaranteed_cost_note: spec.bound === null ? "" : "frozen yaw",
    actual_cost: flight.diverged === null ? last.cost : null,
    settling_time_s: flight.diverged === null ? 3.85 + 1.9 * spec.lag_s : null,
    peak_input: Math.max(...forces.map(Math.abs)),
    saturated_share: atLimit / flight.rows.length,
    input_limits: [1, 2, 3, 4].map(() => (spec.limits ? { min: spec.limits[0], max: spec.limits[1] } : { min: null, max: null })),
    states: STATES.map((_, i) => at((r) => r.x[i])),
    inputs: [0, 1, 2, 3].map((i) => at((r) => r.F[i])),
    weights: WEIGHTS.map((w) => at((r) => w(r.x[11]) / 4)),
    cost: at((r) => r.cost),
    measurement: noise > 0 && estimation ? [3, 4, 5, 9, 10, 11].map((i) => at((r) => r.x[i] + (i < 9 ? 0.1 : 0.0873) * gauss())) : null,
    governed: null,
    set_share: null,
    estimation: noise > 0 && estimation ? { error, sigma3, inside_share: error.map((e, i) => e.filter((v, k) => Math.abs(v) <= sigma3[i][k]).length / e.length) } : null,
  };
}

/** Puts data into the built page, as the program does. */
export function fillPage(template, report) {
  const json = JSON.stringify(report).replaceAll("</", "<\\/");
  return template.replace("/*LPV_REPORT_DATA*/", () => json);
}
