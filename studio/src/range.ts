// The vertical range of a plot.
//
// One run that diverges, or one without limits, must not flatten all others: the range is that of the completed
// runs and the reference. A run that leaves it, because it diverged or because its own span is more than
// OUTLIER times the usual one, may widen the range a little and is otherwise cut off; the plot says so.
// "Usual" needs a yardstick, the limits or a moving reference: without one no completed run is an outlier.

import type { Run, Series } from "./data";
import { extent, median, union } from "./samples";

/** One line of a plot, as far as its range matters. */
export interface Ranged {
  /** The run it belongs to; null for a reference or a band. */
  run: Run | null;
  values: Series;
}

export interface VerticalRange {
  low: number;
  high: number;
  /** Runs that leave the range. */
  clipped: Run[];
}

/** How many times the usual span a completed run may have before it counts as an outlier. */
const OUTLIER = 4;
/** How much of the span a diverged or outlying run may add on each side. */
const ALLOWANCE = 0.25;
/** Space above and below, as a share of the span. */
const MARGIN = 0.06;
/** No plot is magnified beyond this span, in the shown unit: below it there is only rounding. */
const LEAST_SPAN = 0.01;

/** The range for samples `from..=to`; `include` are values that must be inside (limits). */
export function verticalRange(lines: Ranged[], from: number, to: number, include: number[], full: boolean): VerticalRange {
  const found = lines.flatMap((line) => {
    const range = extent(line.values, from, to);
    return range ? [{ run: line.run, range }] : [];
  });
  let core: [number, number] | null = include.length > 0 ? [Math.min(...include), Math.max(...include)] : null;
  const fixed = found.filter((f) => f.run === null);
  const completed = found.filter((f) => f.run?.outcome.kind === "completed");
  const yardstick = Math.max(core ? core[1] - core[0] : 0, ...fixed.map((f) => f.range[1] - f.range[0]));
  const usual = completed.length > 0 && yardstick > 0 ? Math.max(yardstick, median(completed.map((f) => f.range[1] - f.range[0]))) : Infinity;
  const isSound = (f: (typeof found)[number]): boolean =>
    full || f.run === null || (f.run.outcome.kind === "completed" && f.range[1] - f.range[0] <= OUTLIER * usual);
  for (const f of found) if (isSound(f)) core = union(core, f.range);
  if (completed.length === 0 && !full) {
    // Only diverged runs: show where they are most of the time, not where they end.
    const reach = yardstick > 0 && core ? [core[0] - yardstick, core[1] + yardstick] as const : [-Infinity, Infinity] as const;
    for (const line of lines) {
      const usualOne = line.run ? usualRange(line.values, from, to) : null;
      if (usualOne) core = union(core, [clamp(usualOne[0], ...reach), clamp(usualOne[1], ...reach)]);
    }
  }
  if (!core) return { low: 0, high: 1, clipped: [] };

  const span = Math.max(core[1] - core[0], LEAST_SPAN);
  let low = Math.min(core[0], (core[0] + core[1] - span) / 2);
  let high = Math.max(core[1], (core[0] + core[1] + span) / 2);
  for (const f of found) {
    if (isSound(f)) continue;
    low = Math.min(low, Math.max(f.range[0], core[0] - ALLOWANCE * span));
    high = Math.max(high, Math.min(f.range[1], core[1] + ALLOWANCE * span));
  }
  const margin = MARGIN * (high - low);
  low -= margin;
  high += margin;
  const clipped = found.flatMap((f) => (f.run && (f.range[0] < low || f.range[1] > high) ? [f.run] : []));
  return { low, high, clipped };
}

/** The range without the lowest and the highest tenth of the samples. */
function usualRange(values: Series, from: number, to: number): [number, number] | null {
  const sorted = values.slice(from, to + 1).filter((v) => v !== null).sort((a, b) => a - b);
  const cut = Math.floor(sorted.length / 10);
  return sorted.length > 0 ? [sorted[cut]!, sorted[sorted.length - 1 - cut]!] : null;
}

function clamp(value: number, low: number, high: number): number {
  return Math.min(Math.max(value, low), high);
}
