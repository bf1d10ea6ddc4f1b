// The shared clock: one time for the 3D view and all plots.
//
// `time` is where the clock stands. `preview` is a time that the pointer hovers over in a plot: while it is
// there, everything shows it instead, and the clock stays where it is. Hovering does nothing while playing.

import { Signal } from "./signal";

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8] as const;

export class Timeline {
  readonly changed = new Signal();
  private time: number;
  private preview: number | null = null;
  private frame = 0;
  private lastTick = 0;
  speed = 1;

  constructor(
    readonly start: number,
    readonly end: number,
    initial: number,
  ) {
    this.time = initial;
  }

  /** The time to show. */
  get now(): number {
    return this.preview ?? this.time;
  }

  get playing(): boolean {
    return this.frame !== 0;
  }

  seek(time: number): void {
    this.preview = null;
    this.time = this.clamp(time);
    this.changed.emit();
  }

  hover(time: number | null): void {
    const next = time === null || this.playing ? null : this.clamp(time);
    if (next === this.preview) return;
    this.preview = next;
    this.changed.emit();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.changed.emit();
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Starts the clock; from the beginning if it stands at the end. */
  play(): void {
    if (this.playing) return;
    this.preview = null;
    if (this.time >= this.end - 1e-9) this.time = this.start;
    this.lastTick = performance.now();
    this.frame = requestAnimationFrame(this.tick);
    this.changed.emit();
  }

  pause(): void {
    if (!this.playing) return;
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.changed.emit();
  }

  private readonly tick = (nowMs: number): void => {
    // A tab that was in the background comes back with a long gap: do not jump over it.
    const elapsed_s = Math.min(Math.max(nowMs - this.lastTick, 0) / 1000, 0.25);
    this.lastTick = nowMs;
    this.time = this.clamp(this.time + elapsed_s * this.speed);
    this.frame = this.time >= this.end ? 0 : requestAnimationFrame(this.tick);
    this.changed.emit();
  };

  private clamp(time: number): number {
    return Math.min(Math.max(time, this.start), this.end);
  }
}
