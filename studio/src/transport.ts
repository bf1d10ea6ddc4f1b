// The bar at the bottom: play, scrub, speed. It moves the clock that everything else follows.

import type { Report } from "./data";
import { el, icon } from "./dom";
import { fixed } from "./format";
import { SPEEDS, type Timeline } from "./timeline";

const PLAY = "M8 5l11 7l-11 7z";
const PAUSE = "M8 5v14M16 5v14";
const SCRUB_STEP_S = 0.01;
const KEY_STEP_S = 0.1;
const BIG_KEY_STEP_S = 1;

export function transportBar(report: Report, timeline: Timeline): HTMLElement {
  const length = timeline.end - timeline.start;
  const play = el("button", { type: "button", class: "play-button", id: "play", onclick: () => timeline.toggle() });
  const readout = el("output", { class: "time-readout", id: "time", "aria-live": "off" });
  const scrub = el("input", {
    type: "range",
    id: "scrub",
    min: timeline.start,
    max: timeline.end,
    step: SCRUB_STEP_S,
    "aria-label": "Time",
    oninput: () => timeline.seek(Number(scrub.value)),
  });
  const ticks = report.steps
    .filter((s) => s.time_s >= timeline.start && s.time_s <= timeline.end)
    .map((step) =>
      el("button", {
        type: "button",
        class: "step-tick",
        tabindex: -1,
        title: `${fixed(step.time_s, 1)} s: ${step.label}`,
        "aria-label": `Go to ${fixed(step.time_s, 1)} s: ${step.label}`,
        style: `--at: ${((step.time_s - timeline.start) / length).toFixed(5)}`,
        onclick: () => timeline.seek(step.time_s),
      }),
    );
  const speed = el("select", { id: "speed", "aria-label": "Speed", onchange: () => timeline.setSpeed(Number(speed.value)) }, ...SPEEDS.map((s) => el("option", { value: s, selected: s === 1 }, `${s}×`)));
  const step = el("span", { class: "step-label" });

  let wasPlaying: boolean | null = null;
  const paint = (): void => {
    const now = timeline.now;
    if (timeline.playing !== wasPlaying) {
      wasPlaying = timeline.playing;
      play.replaceChildren(icon(wasPlaying ? PAUSE : PLAY));
      play.setAttribute("aria-label", wasPlaying ? "Pause" : "Play");
      play.title = `${wasPlaying ? "Pause" : "Play"} (space)`;
      play.classList.toggle("is-playing", wasPlaying);
    }
    readout.replaceChildren(el("b", {}, fixed(now, 2)), ` / ${fixed(timeline.end, 0)} s`);
    scrub.value = String(now);
    scrub.setAttribute("aria-valuetext", `${fixed(now, 2)} seconds`);
    scrub.style.setProperty("--done", `${((100 * (now - timeline.start)) / length).toFixed(3)}%`);
    step.textContent = report.steps.filter((s) => s.time_s <= now + 1e-9).at(-1)?.label ?? "";
    step.title = step.textContent;
  };
  paint();
  timeline.changed.listen(paint);
  listenToKeys(timeline);
  return el("div", { class: "transport", role: "group", "aria-label": "Playback" }, play, readout, el("div", { class: "scrub" }, scrub, ...ticks), step, speed);
}

/** Space plays and pauses, arrows step, wherever the focus is not in a control of its own. */
function listenToKeys(timeline: Timeline): void {
  addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const target = event.target as Element;
    if (target.closest("select, textarea, input:not([type=range]):not([type=checkbox])")) return;
    const inButton = target.closest("button, summary, input[type=checkbox]") !== null;
    const arrow = event.shiftKey ? BIG_KEY_STEP_S : KEY_STEP_S;
    if (event.key === " " && !inButton) timeline.toggle();
    else if (event.key === "ArrowLeft") timeline.seek(timeline.now - arrow);
    else if (event.key === "ArrowRight") timeline.seek(timeline.now + arrow);
    else if (event.key === "Home" && target.id === "scrub") timeline.seek(timeline.start);
    else if (event.key === "End" && target.id === "scrub") timeline.seek(timeline.end);
    else return;
    event.preventDefault();
  });
}
