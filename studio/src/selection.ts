// Which runs are shown, which one is pointed at, and which one is picked (and followed by the camera).

import type { Run } from "./data";
import { Signal } from "./signal";

export class Selection {
  readonly changed = new Signal();
  private readonly hidden = new Set<string>();
  private hovered: Run | null = null;
  private picked: Run | null = null;

  isVisible(run: Run): boolean {
    return !this.hidden.has(run.id);
  }

  /** The run to bring out: the one pointed at, else the one picked; never a hidden one. */
  get highlighted(): Run | null {
    const run = this.hovered ?? this.picked;
    return run && this.isVisible(run) ? run : null;
  }

  get selected(): Run | null {
    return this.picked;
  }

  setVisible(run: Run, visible: boolean): void {
    if (visible) this.hidden.delete(run.id);
    else this.hidden.add(run.id);
    if (!visible && this.picked === run) this.picked = null;
    this.changed.emit();
  }

  hover(run: Run | null): void {
    if (this.hovered === run) return;
    this.hovered = run;
    this.changed.emit();
  }

  /** Picks a run; picking it again lets it go. */
  toggleSelected(run: Run): void {
    this.select(this.picked === run ? null : run);
  }

  select(run: Run | null): void {
    if (run) this.hidden.delete(run.id);
    this.picked = run;
    this.changed.emit();
  }
}
