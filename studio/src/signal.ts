// A list of listeners: the page's parts hear of a change here and never call each other.

/** Something that changes and tells who listens. */
export class Signal {
  private readonly listeners = new Set<() => void>();

  /** Calls `listener` after every change; returns the function that stops this. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  emit(): void {
    for (const listener of this.listeners) listener();
  }
}
