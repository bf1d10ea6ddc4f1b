// The report's data: what the program writes into the page, and the check that it is whole.
//
// All series of a run share the sample times `Report.time`; a sample that does not exist
// (after a divergence) is null. Units are SI and radians; the page converts to degrees when it draws.

/** What a claim is worth; see the legend under the table. */
export type Verdict = "proved" | "numerical" | "refuted" | "undecided";

/** Samples on `Report.time`; null where there is none. */
export type Series = (number | null)[];

/** A named quantity, such as `r_x` in `m`. */
export interface Channel {
  name: string;
  /** SI unit; `rad` and `rad/s` are shown in degrees. Empty for a pure number. */
  unit: string;
}

/** How to draw the plant in space. */
export interface RigidBody {
  kind: "rigid-body";
  /** Indices into the states: x, y, z of the centre of mass, earth frame, z up. */
  position: [number, number, number];
  /** Indices into the states: roll φ, pitch θ, yaw ψ; body_from_earth = R_xyz(φ, θ, ψ). */
  euler_xyz: [number, number, number];
  /** Distance of a rotor from the centre. */
  arm_length_m: number;
  /** Rotor positions in the body frame, metres, in the order of the inputs. */
  rotors: [number, number, number][];
}

/** The controlled plant: its signals and, if it moves in space, its shape. */
export interface Plant {
  name: string;
  states: Channel[];
  inputs: Channel[];
  outputs: Channel[];
  /** Whether its linear model leaves nothing out. */
  linear: boolean;
  scene: RigidBody | null;
}

/** How the parameter may move, as far as a claim says. */
export type Motion = { motion: "none" | "at-rest" | "hull" | "any" } | { motion: "bounded"; rate: number };

/** A state whose own motion breaks a claim, at this parameter and rate. */
export interface Witness {
  parameter: number | null;
  rate: number | null;
  /** The states; of a matrix with a border a direction, the border first. */
  state: (number | null)[];
}

/** One claim about a design or a flight, as the certificate decided it. */
export interface Claim {
  /** Its name among the run's claims, such as `inner[0].unsaturated`; claims about steps of a flight share one. */
  id: string;
  /** What is claimed: `cost`, `invariance`, …; the fields below that it has depend on it. */
  kind: string;
  /** The system that it is about: the LPV model or the nonlinear plant. */
  of: "model" | "plant";
  /** The statement. */
  claim: string;
  /** Ids of the claims that it rests on. */
  premises: string[];
  verdict: Verdict;
  /** By how much it holds or, negative, fails; null where that is not known. */
  margin: number | null;
  /** Parameter at which the margin is attained, or the check stopped. */
  at: number | null;
  detail: string;
  witness?: Witness;
  /** Cells of the parameter's range that a proof took. */
  cells: number;
  /** γ of the set {V ≤ γ}; null where there is none. */
  level?: number | null;
  /** The cost is at most this times V at the start. */
  factor?: number;
  motion?: Motion;
  sample_time_s?: number;
  /** Bound on the cost of a step. */
  bound?: number;
}

/** How a simulation ended. */
export type Outcome =
  | { kind: "completed" }
  | {
      kind: "diverged";
      time_s: number;
      /** The state that left its bounds. */
      state: string;
      detail: string;
    };

/** Errors of the estimator against the true state, per state. */
export interface Estimation {
  error: Series[];
  /** Three standard deviations, from the estimator's own covariance. */
  sigma3: Series[];
  /** Share of the samples inside ±3σ, 0 to 1. */
  inside_share: number[];
}

/** One controller, flown once. */
export interface Run {
  id: string;
  label: string;
  /** Place in the palette; any non-negative integer. */
  color_index: number;
  /** One-line description. */
  controller: string;
  /** What is known of the design, whatever it flies. */
  verdict: Verdict;
  claims: Claim[];
  /** What proves the claims about the design again, for a shell. */
  certify_command: string;
  /** Largest singular value of the gains that fly, over the grid points and the sets of a family. */
  largest_gain: number;
  /** The largest rate of the parameter for which set and cost bound are proved, 0 at rest; null where they are not. */
  proved_rate: number | null;
  outcome: Outcome;
  /** Upper bound on the cost of this flight that is proved of the plant as it flies, sampled and saturated, or null. */
  guaranteed_cost: number | null;
  /** The same of the nonlinear plant with a controller in continuous time, or null. */
  plant_cost_bound: number | null;
  /** The same of the LPV model with a controller in continuous time, where none is proved of the plant; worth what its verdict says, under the condition in the note. */
  model_cost_bound: number | null;
  guaranteed_cost_verdict: Verdict;
  guaranteed_cost_note: string;
  actual_cost: number | null;
  settling_time_s: number | null;
  /** Largest input over all channels, in the inputs' unit. */
  peak_input: number;
  /** Share of the time in which at least one input is at a limit, 0 to 1. */
  saturated_share: number;
  /** Per input; null means unlimited on that side. */
  input_limits: { min: number | null; max: number | null }[];
  /** [state][sample] */
  states: Series[];
  /** [input][sample], after saturation. */
  inputs: Series[];
  /** [weight][sample]: the scheduling weights ρᵢ. */
  weights: Series[];
  /** Cost accumulated so far. */
  cost: Series;
  /** Per state: the reference that a governor made of the set point, or null where it is of no interest; null without a governor. */
  governed: (Series | null)[] | null;
  /** V/γ of the error in the certified set that held it, or null for a controller that does not watch one. */
  set_share: Series | null;
  /** [output][sample], with noise, or null when the state is known. */
  measurement: Series[] | null;
  estimation: Estimation | null;
}

/** The whole report. */
export interface Report {
  schema: "lpv-report/1";
  title: string;
  scenario: string;
  description: string;
  version: string;
  seed: number;
  sample_time_s: number;
  plant: Plant;
  scheduling: { parameter: string; unit: string; weights: string[] };
  /** Sample times of all runs, seconds, increasing. */
  time: number[];
  /** Per state: the set point over time, or null when there is none to show. */
  reference: (Series | null)[];
  /** Set-point changes. */
  steps: { time_s: number; label: string }[];
  runs: Run[];
  /** Warnings and remarks, plain text. */
  notes: string[];
}

/** The data do not fit the schema; `problems` says where. */
export class DataError extends Error {
  constructor(readonly problems: string[]) {
    super(problems.join("\n"));
  }
}

const SCHEMA = "lpv-report/1";
const VERDICTS: readonly string[] = ["proved", "numerical", "refuted", "undecided"];
const MAX_PROBLEMS = 12;

type Dict = Record<string, unknown>;

/** Walks the data and collects what is wrong, each with its path. */
class Checker {
  readonly problems: string[] = [];

  fail(path: string, expected: string, value: unknown): void {
    if (this.problems.length < MAX_PROBLEMS) this.problems.push(`${path}: expected ${expected}, found ${describe(value)}`);
  }

  dict(value: unknown, path: string): Dict | null {
    if (typeof value === "object" && value !== null && !Array.isArray(value)) return value as Dict;
    this.fail(path, "an object", value);
    return null;
  }

  list(value: unknown, path: string, length?: number): unknown[] {
    if (!Array.isArray(value)) this.fail(path, "a list", value);
    else if (length !== undefined && value.length !== length) this.fail(path, `a list of length ${length}`, value);
    else return value;
    return [];
  }

  text(value: unknown, path: string): void {
    if (typeof value !== "string") this.fail(path, "a text", value);
  }

  number(value: unknown, path: string): void {
    if (typeof value !== "number") this.fail(path, "a number", value);
  }

  flag(value: unknown, path: string): void {
    if (typeof value !== "boolean") this.fail(path, "true or false", value);
  }

  numberOrNull(value: unknown, path: string): void {
    if (value !== null) this.number(value, path);
  }

  verdict(value: unknown, path: string): void {
    if (typeof value !== "string" || !VERDICTS.includes(value)) this.fail(path, `one of ${VERDICTS.join(", ")}`, value);
  }

  /** A series on the common sample times. */
  series(value: unknown, path: string, samples: number): void {
    const bad = this.list(value, path, samples).findIndex((v) => v !== null && typeof v !== "number");
    if (bad >= 0) this.fail(`${path}[${bad}]`, "a number or null", (value as unknown[])[bad]);
  }

  table(value: unknown, path: string, rows: number, samples: number): void {
    this.list(value, path, rows).forEach((row, i) => this.series(row, `${path}[${i}]`, samples));
  }

  channels(value: unknown, path: string): number {
    const list = this.list(value, path);
    list.forEach((item, i) => {
      const channel = this.dict(item, `${path}[${i}]`);
      if (!channel) return;
      this.text(channel.name, `${path}[${i}].name`);
      this.text(channel.unit, `${path}[${i}].unit`);
    });
    return list.length;
  }
}

function describe(value: unknown): string {
  if (value === undefined) return "nothing";
  if (value === null) return "null";
  if (Array.isArray(value)) return `a list of length ${value.length}`;
  if (typeof value === "object") return "an object";
  const text = JSON.stringify(value);
  return text.length > 40 ? `${text.slice(0, 40)}…` : text;
}

function checkScene(check: Checker, value: unknown, states: number): void {
  if (value === null) return;
  const scene = check.dict(value, "plant.scene");
  if (!scene) return;
  if (scene.kind !== "rigid-body") check.fail("plant.scene.kind", '"rigid-body"', scene.kind);
  for (const key of ["position", "euler_xyz"]) {
    check.list(scene[key], `plant.scene.${key}`, 3).forEach((index, i) => {
      const ok = typeof index === "number" && Number.isInteger(index) && index >= 0 && index < states;
      if (!ok) check.fail(`plant.scene.${key}[${i}]`, `a state index below ${states}`, index);
    });
  }
  check.number(scene.arm_length_m, "plant.scene.arm_length_m");
  check.list(scene.rotors, "plant.scene.rotors").forEach((rotor, i) => {
    check.list(rotor, `plant.scene.rotors[${i}]`, 3).forEach((v, k) => check.number(v, `plant.scene.rotors[${i}][${k}]`));
  });
}

interface Sizes {
  states: number;
  inputs: number;
  outputs: number;
  weights: number;
  samples: number;
}

const MOTIONS: readonly unknown[] = ["none", "at-rest", "bounded", "hull", "any"];

function checkClaim(check: Checker, value: unknown, path: string): void {
  const claim = check.dict(value, path);
  if (!claim) return;
  for (const key of ["id", "kind", "claim", "detail"]) check.text(claim[key], `${path}.${key}`);
  if (claim.of !== "model" && claim.of !== "plant") check.fail(`${path}.of`, '"model" or "plant"', claim.of);
  check.list(claim.premises, `${path}.premises`).forEach((id, i) => check.text(id, `${path}.premises[${i}]`));
  check.verdict(claim.verdict, `${path}.verdict`);
  // numbers that are not finite are null in JSON
  for (const key of ["margin", "at"]) check.numberOrNull(claim[key], `${path}.${key}`);
  check.number(claim.cells, `${path}.cells`);
  for (const key of ["level", "factor", "sample_time_s", "bound"]) {
    if (claim[key] !== undefined) check.numberOrNull(claim[key], `${path}.${key}`);
  }
  if (claim.motion !== undefined) checkMotion(check, claim.motion, `${path}.motion`);
  if (claim.witness !== undefined) checkWitness(check, claim.witness, `${path}.witness`);
}

function checkMotion(check: Checker, value: unknown, path: string): void {
  const motion = check.dict(value, path);
  if (!motion) return;
  if (!MOTIONS.includes(motion.motion)) check.fail(`${path}.motion`, `one of ${MOTIONS.join(", ")}`, motion.motion);
  if (motion.motion === "bounded") check.number(motion.rate, `${path}.rate`);
}

function checkWitness(check: Checker, value: unknown, path: string): void {
  const witness = check.dict(value, path);
  if (!witness) return;
  for (const key of ["parameter", "rate"]) check.numberOrNull(witness[key], `${path}.${key}`);
  check.list(witness.state, `${path}.state`).forEach((v, i) => check.numberOrNull(v, `${path}.state[${i}]`));
}

function checkRun(check: Checker, value: unknown, path: string, size: Sizes): void {
  const run = check.dict(value, path);
  if (!run) return;
  for (const key of ["id", "label", "controller", "certify_command", "guaranteed_cost_note"]) check.text(run[key], `${path}.${key}`);
  for (const key of ["color_index", "largest_gain", "peak_input", "saturated_share"]) check.number(run[key], `${path}.${key}`);
  for (const key of ["guaranteed_cost", "plant_cost_bound", "model_cost_bound", "actual_cost", "settling_time_s", "proved_rate"]) check.numberOrNull(run[key], `${path}.${key}`);
  check.verdict(run.verdict, `${path}.verdict`);
  check.verdict(run.guaranteed_cost_verdict, `${path}.guaranteed_cost_verdict`);
  check.list(run.claims, `${path}.claims`).forEach((item, i) => checkClaim(check, item, `${path}.claims[${i}]`));
  const outcome = check.dict(run.outcome, `${path}.outcome`);
  if (outcome && outcome.kind === "diverged") {
    check.number(outcome.time_s, `${path}.outcome.time_s`);
    check.text(outcome.state, `${path}.outcome.state`);
    check.text(outcome.detail, `${path}.outcome.detail`);
  } else if (outcome && outcome.kind !== "completed") {
    check.fail(`${path}.outcome.kind`, '"completed" or "diverged"', outcome.kind);
  }
  check.list(run.input_limits, `${path}.input_limits`, size.inputs).forEach((item, i) => {
    const limit = check.dict(item, `${path}.input_limits[${i}]`);
    if (!limit) return;
    check.numberOrNull(limit.min, `${path}.input_limits[${i}].min`);
    check.numberOrNull(limit.max, `${path}.input_limits[${i}].max`);
  });
  check.table(run.states, `${path}.states`, size.states, size.samples);
  check.table(run.inputs, `${path}.inputs`, size.inputs, size.samples);
  check.table(run.weights, `${path}.weights`, size.weights, size.samples);
  check.series(run.cost, `${path}.cost`, size.samples);
  if (run.governed !== null) {
    check.list(run.governed, `${path}.governed`, size.states).forEach((row, i) => {
      if (row !== null) check.series(row, `${path}.governed[${i}]`, size.samples);
    });
  }
  if (run.set_share !== null) check.series(run.set_share, `${path}.set_share`, size.samples);
  if (run.measurement !== null) check.table(run.measurement, `${path}.measurement`, size.outputs, size.samples);
  if (run.estimation !== null) {
    const estimation = check.dict(run.estimation, `${path}.estimation`);
    if (!estimation) return;
    check.table(estimation.error, `${path}.estimation.error`, size.states, size.samples);
    check.table(estimation.sigma3, `${path}.estimation.sigma3`, size.states, size.samples);
    check.list(estimation.inside_share, `${path}.estimation.inside_share`, size.states).forEach((v, i) => check.number(v, `${path}.estimation.inside_share[${i}]`));
  }
}

/** Reads and checks the report; throws a `DataError` that names each place that does not fit. */
export function parseReport(text: string): Report {
  if (text.trim().startsWith("/*")) throw new DataError(["This page is the empty template: the program has not put any data into it."]);
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch (error) {
    throw new DataError([`The data are not JSON: ${error instanceof Error ? error.message : String(error)}`]);
  }
  const check = new Checker();
  const report = check.dict(value, "report");
  if (!report) throw new DataError(check.problems);
  if (report.schema !== SCHEMA) throw new DataError([`schema: this page reads ${SCHEMA}, the data are ${describe(report.schema)}. Page and program must be of one version.`]);

  for (const key of ["title", "scenario", "description", "version"]) check.text(report[key], key);
  for (const key of ["seed", "sample_time_s"]) check.number(report[key], key);
  const size: Sizes = { states: 0, inputs: 0, outputs: 0, weights: 0, samples: 0 };
  const plant = check.dict(report.plant, "plant");
  if (plant) {
    check.text(plant.name, "plant.name");
    size.states = check.channels(plant.states, "plant.states");
    size.inputs = check.channels(plant.inputs, "plant.inputs");
    size.outputs = check.channels(plant.outputs, "plant.outputs");
    check.flag(plant.linear, "plant.linear");
    checkScene(check, plant.scene, size.states);
  }
  const scheduling = check.dict(report.scheduling, "scheduling");
  if (scheduling) {
    check.text(scheduling.parameter, "scheduling.parameter");
    check.text(scheduling.unit, "scheduling.unit");
    size.weights = check.list(scheduling.weights, "scheduling.weights").length;
  }
  const time = check.list(report.time, "time");
  size.samples = time.length;
  if (time.length < 2) check.fail("time", "at least two samples", report.time);
  const bad = time.findIndex((t, i) => typeof t !== "number" || (i > 0 && !(t > (time[i - 1] as number))));
  if (bad >= 0) check.fail(`time[${bad}]`, "a number above the one before", time[bad]);
  check.list(report.reference, "reference", size.states).forEach((row, i) => {
    if (row !== null) check.series(row, `reference[${i}]`, size.samples);
  });
  check.list(report.steps, "steps").forEach((item, i) => {
    const step = check.dict(item, `steps[${i}]`);
    if (!step) return;
    check.number(step.time_s, `steps[${i}].time_s`);
    check.text(step.label, `steps[${i}].label`);
  });
  check.list(report.runs, "runs").forEach((run, i) => checkRun(check, run, `runs[${i}]`, size));
  check.list(report.notes, "notes").forEach((note, i) => check.text(note, `notes[${i}]`));
  if (check.problems.length > 0) throw new DataError(check.problems);
  return value as Report;
}
