// Decimals that err to the safe side: crates/lpv/src/math/decimal.rs, digit by digit.
//
// What is shown of a bound has to follow from what was proved: a rate, level or margin is rounded down, a cost, gain
// or time up. A decimal stands for the double that it is read as: 0.1 is not less than the double 0.1. The digits are
// those of the double's exact decimal expansion, cut or raised. Nothing that is not zero is written as zero.

/** Which way a number may err when it is written. */
export type Rounding = "down" | "up" | "nearest";

/** Decimal exponents that are written out; beyond them the exponent form is shorter. */
const LEAST_PLAIN = -4;
const MOST_PLAIN = 6;

/** `value` with at most `digits` significant digits, rounded as asked, as a plain text such as 9.807 or 1.2e-8. */
export function decimal(value: number, digits: number, rounding: Rounding): string {
  if (value === 0 || Number.isNaN(value)) return String(value + 0);
  if (!Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  const negative = value < 0;
  const size = Math.abs(value);
  const [all, exponent] = expansion(size);
  const cut = all.slice(0, digits).padEnd(digits, "0");
  const [raised, raisedExponent] = raise(cut, exponent);
  const isExact = Number(written(cut, exponent)) === size;
  const awayFromZero = rounding === "nearest" ? Number(all[digits] ?? "0") >= 5 : (rounding === "up") !== negative && !isExact;
  // cut away from the double, and yet raised it may be the double itself: then it is on both sides
  const isRaised = awayFromZero || (!isExact && Number(written(raised, raisedExponent)) === size);
  const text = isRaised ? written(raised, raisedExponent) : written(cut, exponent);
  return negative ? `-${text}` : text;
}

/** All digits of a positive double, and the power of ten of the first. */
function expansion(size: number): [string, number] {
  const bits = new DataView(new ArrayBuffer(8));
  bits.setFloat64(0, size);
  const word = bits.getBigUint64(0);
  const biased = Number(word >> 52n);
  const fraction = word & ((1n << 52n) - 1n);
  // size = mantissa 2^power
  const mantissa = biased === 0 ? fraction : fraction | (1n << 52n);
  const power = Math.max(biased, 1) - 1075;
  // 2^-k = 5^k 10^-k
  const digits = String(power >= 0 ? mantissa << BigInt(power) : mantissa * 5n ** BigInt(-power));
  return [digits, digits.length - 1 + Math.min(power, 0)];
}

/** One more in the last place. */
function raise(digits: string, exponent: number): [string, number] {
  const raised = String(BigInt(digits) + 1n);
  return raised.length > digits.length ? [raised.slice(0, digits.length), exponent + 1] : [raised, exponent];
}

/** d.ddd × 10^exponent, without zeros at the end, written out where that is short. */
function written(padded: string, exponent: number): string {
  const digits = padded.replace(/0+$/, "");
  if (exponent < LEAST_PLAIN || exponent > MOST_PLAIN) {
    return `${digits[0]}${digits.length > 1 ? "." : ""}${digits.slice(1)}e${exponent}`;
  }
  if (exponent < 0) return `0.${"0".repeat(-exponent - 1)}${digits}`;
  const whole = exponent + 1;
  return digits.length <= whole ? digits.padEnd(whole, "0") : `${digits.slice(0, whole)}.${digits.slice(whole)}`;
}
