// The page's head: title, description, where the numbers come from, light or dark.

import type { Report } from "./data";
import { el, iconButton } from "./dom";
import type { Theme } from "./theme";

const HALF_MOON = "M12 3a9 9 0 1 0 0 18a9 9 0 0 0 0-18M12 3v18M12 7h4.5M12 11h6.8M12 15h6M12 19h3.5";

export function pageHeader(report: Report, theme: Theme): HTMLElement {
  const facts: [string, string][] = [
    ["scenario", report.scenario],
    ["plant", `${report.plant.name}, ${report.plant.states.length} states, ${report.plant.inputs.length} inputs`],
    ["flown", `${Number((report.time.at(-1)! - report.time[0]!).toFixed(2))} s`],
    ["seed", String(report.seed)],
    ["version", report.version],
  ];
  return el(
    "header",
    { class: "page-header" },
    el("div", { class: "page-title" }, el("h1", {}, report.title), el("p", {}, report.description)),
    el("dl", { class: "facts" }, ...facts.map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value)))),
    iconButton("Switch between light and dark", HALF_MOON, () => theme.toggle()),
  );
}
