// Numbers, units and symbols as a reader expects them.

import { decimal } from "./decimal";
import { el } from "./dom";

const MINUS = "\u2212";
const SUPERSCRIPTS: Record<string, string> = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

const GREEK: Record<string, string> = {
  alpha: "α", beta: "β", gamma: "γ", delta: "δ", epsilon: "ε", zeta: "ζ", eta: "η", theta: "θ", lambda: "λ", mu: "μ", nu: "ν",
  xi: "ξ", rho: "ρ", sigma: "σ", tau: "τ", phi: "φ", chi: "χ", psi: "ψ", omega: "ω",
};

/** Digits of a bound, as everywhere in the program. */
const DIGITS = 5;

/** Of what holds up to a number: rates, levels, regions, margins. Never above it. */
export function atLeast(value: number): string {
  return typeset(decimal(value, DIGITS, "down"));
}

/** Of what is at most a number: costs, gains, times, errors. Never below it. */
export function atMost(value: number): string {
  return typeset(decimal(value, DIGITS, "up"));
}

/** Of what claims nothing: measured, sampled, configured. */
export function about(value: number): string {
  return typeset(decimal(value, DIGITS, "nearest"));
}

/** A plain decimal as a reader expects it: −1.2 × 10⁻⁸. */
function typeset(text: string): string {
  if (text === "NaN") return "–";
  const [mantissa, exponent] = text.replace("inf", "∞").split("e");
  return exponent === undefined ? minus(mantissa!) : `${minus(mantissa!)}\u202f×\u202f10${superscript(exponent)}`;
}

function superscript(exponent: string): string {
  return [...exponent].map((c) => SUPERSCRIPTS[c]).join("");
}

/** A number with a fixed count of decimals. */
export function fixed(value: number, decimals: number): string {
  return minus(value.toFixed(decimals));
}

/** A share as a percentage; "< 0.1 %" rather than a false zero. */
export function percent(share: number): string {
  if (share === 0) return "0 %";
  if (share < 0.001) return "< 0.1 %";
  if (share > 0.999 && share < 1) return "> 99.9 %";
  return `${(100 * share).toFixed(1)} %`;
}

export function seconds(value: number, decimals = 2): string {
  return `${fixed(value, decimals)} s`;
}

function minus(text: string): string {
  return text.replace("-", MINUS);
}

/** Whether a unit is shown in degrees. */
export function isAngle(unit: string): boolean {
  return unit === "rad" || unit.startsWith("rad/");
}

/** What a value in `unit` is multiplied by when it is shown. */
export function displayFactor(unit: string): number {
  return isAngle(unit) ? 180 / Math.PI : 1;
}

/** The unit in which a value in `unit` is shown. */
export function displayUnit(unit: string): string {
  return isAngle(unit) ? unit.replace("rad", "°") : unit.replace("^2", "²");
}

/** Splits `r_x` into base and index and spells Greek letters: `rho_1` is ρ and 1. */
function symbolParts(name: string): [string, string] {
  const [base = "", ...rest] = name.split("_");
  const greek = (word: string): string => GREEK[word] ?? word;
  return [greek(base), rest.map(greek).join(" ")];
}

/** A signal's name as an element: italic letter, lowered index. */
export function symbol(name: string): HTMLElement {
  const [base, index] = symbolParts(name);
  return el("span", { class: "symbol" }, el("i", {}, base), index !== "" && el("sub", {}, index));
}

/** The rate of a signal: its letter with a dot, |d name/dt| where the name is a word. */
export function rateText(name: string): string {
  const [base, index] = symbolParts(name);
  return [...base].length === 1 && index === "" ? `|${base}\u0307|` : `|d${symbolText(name)}/dt|`;
}

/** A signal's name as plain text, for readers without a screen. */
export function symbolText(name: string): string {
  const [base, index] = symbolParts(name);
  return index === "" ? base : `${base} ${index}`;
}
