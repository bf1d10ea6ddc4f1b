// Reading series: the sample at a time, values between samples, ranges.

import type { Series } from "./data";

/** Index of the last sample at or before `t`; 0 before the first. */
export function indexBefore(time: readonly number[], t: number): number {
  let low = 0;
  let high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle]! <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Index of the sample nearest to `t`. */
export function indexNearest(time: readonly number[], t: number): number {
  const i = indexBefore(time, t);
  return i + 1 < time.length && time[i + 1]! - t < t - time[i]! ? i + 1 : i;
}

/** Index of the last sample that exists; -1 if there is none. */
export function lastIndex(series: Series): number {
  for (let i = series.length - 1; i >= 0; i--) if (series[i] !== null) return i;
  return -1;
}

/** Smallest and largest value over samples `from..=to`, or null if none exists. */
export function extent(series: Series, from = 0, to = series.length - 1): [number, number] | null {
  let low = Infinity;
  let high = -Infinity;
  for (let i = from; i <= to; i++) {
    const v = series[i];
    if (v === null || v === undefined) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  return low <= high ? [low, high] : null;
}

export function union(a: [number, number] | null, b: [number, number] | null): [number, number] | null {
  if (!a) return b;
  if (!b) return a;
  return [Math.min(a[0], b[0]), Math.max(a[1], b[1])];
}

/** The series times `factor`; the same object when the factor is one. */
export function scaled(series: Series, factor: number): Series {
  return factor === 1 ? series : series.map((v) => (v === null ? null : v * factor));
}

/** 1, 2 or 5 times a power of ten: the largest such step not above `value`. */
export function niceStep(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const mantissa = value / power;
  return (mantissa >= 5 ? 5 : mantissa >= 2 ? 2 : 1) * power;
}

/** The median of a list that is not empty. */
export function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 === 1 ? sorted[middle]! : (sorted[middle - 1]! + sorted[middle]!) / 2;
}

/** How much a series goes up and down, in units of its own range: 1 for a ramp, hundreds for noise. */
export function roughness(series: Series): number {
  const range = extent(series);
  if (!range || range[1] === range[0]) return 0;
  let way = 0;
  for (let i = 1; i < series.length; i++) way += Math.abs((series[i] ?? series[i - 1] ?? 0) - (series[i - 1] ?? series[i] ?? 0));
  return way / (range[1] - range[0]);
}
