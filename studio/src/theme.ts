// Light and dark, and the palette of the runs.
//
// The colours are told apart with the common kinds of colour blindness, and are dark (light) enough on a
// light (dark) page; still, no run is known by colour alone: each has a letter, a dash and a marker too.

import type { Run } from "./data";
import { Signal } from "./signal";

export type Mode = "light" | "dark";

interface RunStyle {
  light: string;
  dark: string;
  /** Line pattern in CSS pixels; empty is solid. */
  dash: number[];
  marker: Marker;
}

export type Marker = "circle" | "square" | "triangle" | "diamond" | "plus" | "ring" | "down" | "cross";

const RUN_STYLES: readonly RunStyle[] = [
  { light: "#0a6ebd", dark: "#58aef5", dash: [], marker: "circle" },
  { light: "#cc4e00", dark: "#ff9152", dash: [9, 4], marker: "square" },
  { light: "#00805c", dark: "#35cfa0", dash: [2, 3], marker: "triangle" },
  { light: "#a8408f", dark: "#ea93d3", dash: [9, 3, 2, 3], marker: "diamond" },
  { light: "#a87400", dark: "#f2c744", dash: [15, 4], marker: "plus" },
  { light: "#3c4a5c", dark: "#c3cedd", dash: [4, 2], marker: "ring" },
  { light: "#5a30b8", dark: "#9573ff", dash: [12, 3, 2, 3, 2, 3], marker: "down" },
  { light: "#2d9fd0", dark: "#a4e0ff", dash: [6, 6], marker: "cross" },
  { light: "#7d4e2d", dark: "#d2a679", dash: [5, 2, 1, 2], marker: "circle" },
  { light: "#5f6d00", dark: "#c5d65b", dash: [14, 3, 5, 3], marker: "square" },
];

/** Colours that canvases need; the page's own are in style.css. */
interface Inks {
  text: string;
  muted: string;
  grid: string;
  gridStrong: string;
  reference: string;
  limit: string;
  band: string;
  bandEdge: string;
  panel: string;
  saturated: string;
  axisX: string;
  axisY: string;
  axisZ: string;
  body: string;
}

const INKS: Record<Mode, Inks> = {
  light: {
    text: "#1b2430",
    muted: "#5a6675",
    grid: "#e7ebf0",
    gridStrong: "#c3ccd6",
    reference: "#8a94a1",
    limit: "#b3261e",
    band: "rgba(90, 110, 140, 0.16)",
    bandEdge: "#8391a3",
    panel: "#ffffff",
    saturated: "#d4001f",
    axisX: "#b3261e",
    axisY: "#2b7a2b",
    axisZ: "#2456b8",
    body: "#2a323d",
  },
  dark: {
    text: "#e4e9f0",
    muted: "#98a4b3",
    grid: "#252d38",
    gridStrong: "#3d4858",
    reference: "#7f8b9b",
    limit: "#ff7b72",
    band: "rgba(150, 175, 210, 0.18)",
    bandEdge: "#73839a",
    panel: "#141a22",
    saturated: "#ff5263",
    axisX: "#ff8078",
    axisY: "#73c873",
    axisZ: "#80aaff",
    body: "#cfd7e2",
  },
};

const STORE_KEY = "lpv-report-theme";

export class Theme {
  readonly changed = new Signal();
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  private chosen: Mode | null = readChoice();

  constructor() {
    this.system.addEventListener("change", () => this.apply());
    this.apply();
  }

  get mode(): Mode {
    return this.chosen ?? (this.system.matches ? "dark" : "light");
  }

  get inks(): Inks {
    return INKS[this.mode];
  }

  toggle(): void {
    this.chosen = this.mode === "dark" ? "light" : "dark";
    try {
      localStorage.setItem(STORE_KEY, this.chosen);
    } catch {
      // Pages opened from disk may have no storage: the choice then lasts as long as the page.
    }
    this.apply();
  }

  color(run: Run): string {
    return runStyle(run)[this.mode];
  }

  private apply(): void {
    document.documentElement.dataset.theme = this.mode;
    this.changed.emit();
  }
}

function readChoice(): Mode | null {
  try {
    const value = localStorage.getItem(STORE_KEY);
    return value === "light" || value === "dark" ? value : null;
  } catch {
    return null;
  }
}

function runStyle(run: Run): RunStyle {
  const index = ((Math.trunc(run.color_index) % RUN_STYLES.length) + RUN_STYLES.length) % RUN_STYLES.length;
  return RUN_STYLES[index]!;
}

export function dash(run: Run): number[] {
  return runStyle(run).dash;
}

export function marker(run: Run): Marker {
  return runStyle(run).marker;
}
