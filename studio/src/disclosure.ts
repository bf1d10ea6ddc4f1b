// Buttons that open a panel in the page, one inside another; Escape closes the innermost.

import { el } from "./dom";

/** A panel that is open. */
interface Open {
  button: HTMLButtonElement;
  panel: HTMLElement;
  close: () => void;
}

const opened: Open[] = [];
let count = 0;

/**
 * Makes `button` open what `content` builds anew each time; `place` puts the panel into the page. The button says whether
 * it is open, and gets the focus back from a panel that closes around it.
 */
export function disclose(button: HTMLButtonElement, content: () => HTMLElement, place: (panel: HTMLElement) => void): { open: () => void } {
  let panel: HTMLElement | null = null;
  const close = (): void => {
    if (!panel) return;
    const closing = panel;
    const held = closing.contains(document.activeElement);
    panel = null;
    // those inside go with it
    for (let i = opened.length - 1; i >= 0; i--) {
      if (opened[i]!.button === button || closing.contains(opened[i]!.button)) opened.splice(i, 1);
    }
    (closing.closest("[data-holds-panel]") ?? closing).remove();
    button.setAttribute("aria-expanded", "false");
    button.removeAttribute("aria-controls");
    if (held) button.focus();
  };
  const open = (): void => {
    if (panel) return;
    panel = content();
    panel.id = `panel-${++count}`;
    place(panel);
    opened.push({ button, panel, close });
    button.setAttribute("aria-expanded", "true");
    button.setAttribute("aria-controls", panel.id);
  };
  button.setAttribute("aria-expanded", "false");
  button.addEventListener("click", () => (panel ? close() : open()));
  return { open };
}

/** Closes the innermost panel around the focus, else the one that was opened last; false if none is open. */
export function closePanel(): boolean {
  const focus = document.activeElement;
  const last = opened.findLast(({ button, panel }) => button === focus || panel.contains(focus)) ?? opened.at(-1);
  last?.close();
  last?.button.focus();
  return last !== undefined;
}

const COPIED_MS = 1600;

/** A command for a shell, with a button that copies it. */
export function commandLine(command: string): HTMLElement {
  const code = el("code", {}, command);
  const button = el("button", { type: "button", class: "text-button", onclick: () => void copy() }, "Copy");
  const said = el("span", { class: "sr-only", role: "status" });
  const copy = async (): Promise<void> => {
    const done = await copied(command, code);
    button.textContent = done ? "Copied" : "Selected";
    said.textContent = done ? "The command is copied" : "The command is selected";
    setTimeout(() => (button.textContent = "Copy"), COPIED_MS);
  };
  return el("div", { class: "command" }, code, button, said);
}

/** Copies `text`; where the browser does not let a page do that, it is left selected in `shown`. */
async function copied(text: string, shown: HTMLElement): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    getSelection()?.selectAllChildren(shown);
    return document.execCommand("copy");
  }
}
