// Claims as a certificate has them: typed, resting on each other, with the numbers that rounding is about.

const about = (kind, more) => ({ id: kind, kind, of: "model", premises: [], verdict: "proved", margin: 0.01234567, at: 1.2, detail: "relative margin 0.012345, 512 cells", cells: 512, seconds: 0, ...more });

/** A rate, a level and a factor that a rounding to the nearest would overstate or understate. */
export const RATE = 5.34836;
export const LEVEL = 19.99996;
export const FACTOR = 1.010001;

/** A proved design for |dψ/dt| ≤ 5.34836 rad/s, with an inner set. */
function proved() {
  const motion = { motion: "bounded", rate: RATE };
  const member = (prefix, words, level, shown) => [
    about("weights", { id: `${prefix}weights`, claim: `${words}Q is positive semidefinite and R is positive definite`, at: null, cells: 0, detail: "exact" }),
    about("lyapunov-definite", { id: `${prefix}lyapunov-definite`, claim: `${words}P is positive definite for every psi` }),
    about("unsaturated", { id: `${prefix}unsaturated`, level, claim: `${words}the low gain does not saturate on x'P x <= ${shown} for every psi` }),
    about("invariance", { id: `${prefix}invariance`, level, motion, premises: [`${prefix}lyapunov-definite`, `${prefix}unsaturated`], claim: `${words}the set x'P x <= ${shown} is invariant for |dpsi/dt| <= 5.3483 rad/s for every psi` }),
    about("cost", { id: `${prefix}cost`, factor: FACTOR, level, motion, premises: ["weights", "lyapunov-definite", "unsaturated", "invariance"].map((name) => prefix + name), claim: `${words}the cost is at most 1.0101 x(0)'P x(0) from x'P x <= ${shown} for |dpsi/dt| <= 5.3483 rad/s for every psi` }),
    about("sampled-stability", { id: `${prefix}sampled-stability`, sample_time_s: 0.002, claim: `${words}the loop sampled with zero-order hold is stable at T = 0.002 s for every psi, fixed` }),
  ];
  return [...member("", "", LEVEL, "19.999"), ...member("inner[0].", "inner set 1: ", 1, "1")];
}

/** What `lpv run` checks of a frozen design in floating point. */
function checked() {
  return [
    about("grid-inequalities", { verdict: "numerical", margin: 3.2e-7, cells: 0, claim: "matrix inequalities hold at every grid point", detail: "least λ_min = 3.2e-7 of 96 blocks" }),
    about("frozen-stability", { verdict: "numerical", margin: 0.7071, cells: 0, claim: "the closed loop is stable for every psi, fixed", detail: "largest real part −0.7071 over 720 yaws" }),
  ];
}

/** A loop that a state of its own refutes. */
function refuted() {
  const state = [0, 0, 0, 1.00004, 0, 0, 0, 0, 0, 0.1, 0, 3.14159];
  const false_ = { verdict: "refuted", margin: -0.5, at: 0.3, cells: 4, witness: { parameter: 0.3, rate: 2, state, value: -0.5 } };
  return [
    about("lyapunov-definite", { claim: "P is positive definite for every psi" }),
    about("decrease", { ...false_, motion: { motion: "bounded", rate: 2 }, premises: ["lyapunov-definite"], claim: "x'P x decreases for |dpsi/dt| <= 2 rad/s for every psi", detail: "false at parameter 0.3 with rate 2: V grows from the state of the witness" }),
    about("cost", { verdict: "undecided", margin: null, at: null, cells: 0, factor: 1.1, level: null, motion: { motion: "bounded", rate: 2 }, premises: ["weights", "lyapunov-definite", "decrease"], claim: "the cost is at most 1.1 x(0)'P x(0) for |dpsi/dt| <= 2 rad/s for every psi", detail: "it rests on what is refuted: x'P x decreases" }),
  ];
}

/** A frozen design: its set is proved, its cost bound at rest or not at all. */
function halfProved() {
  const motion = { motion: "bounded", rate: 0.0142389 };
  return [
    ...checked(),
    about("weights", { claim: "Q is positive semidefinite and R is positive definite", at: null, cells: 0 }),
    about("lyapunov-definite", { claim: "P is positive definite for every psi" }),
    about("unsaturated", { level: 20, claim: "the low gain does not saturate on x'P x <= 20 for every psi" }),
    about("invariance", { level: 20, motion, premises: ["lyapunov-definite", "unsaturated"], claim: "the set x'P x <= 20 is invariant for |dpsi/dt| <= 0.014238 rad/s for every psi" }),
    about("cost", { verdict: "undecided", margin: null, level: 20, factor: 1.1, motion: { motion: "at-rest" }, premises: ["weights", "lyapunov-definite", "unsaturated", "invariance"], claim: "the cost is at most 1.1 x(0)'P x(0) from x'P x <= 20 for every psi, at rest", detail: "open at parameter 0.6" }),
  ];
}

/** A claim about each step of the flight, worth what the flight kept to. */
function steps(verdict) {
  const step = (number, time_s, bound) => about("step-cost", { verdict, step: number, time_s, bound, cells: 0, at: null, margin: 0.16, claim: `step ${number} at t = ${time_s} s costs at most ${bound}`, detail: "inside the certified set of level 20" });
  return [step(1, 1, 391.8001), step(2, 16, 12.5)];
}

/** The claims of a run by the state of its proof, and the rate up to which set and cost bound are proved. */
export function claimsOf(run) {
  const claims = { proved, refuted, undecided: halfProved, numerical: checked }[run.verdict]();
  const flight = run.verdict === "refuted" ? [] : steps(run.verdict);
  return { claims: [...claims, ...flight], certify_command: `lpv certify out/quadrotor/design-${run.id}.json`, largest_gain: 31.6, proved_rate: run.verdict === "proved" ? RATE : null };
}
