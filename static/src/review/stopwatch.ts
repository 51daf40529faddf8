/** How long a pose has been looked at: the time the page was visible since it came up. */
export class Stopwatch {
  private sinceMs = performance.now();
  private beforeMs = 0;

  constructor() {
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) {
        this.beforeMs += performance.now() - this.sinceMs;
      } else {
        this.sinceMs = performance.now();
      }
    });
  }

  restart(): void {
    this.beforeMs = 0;
    this.sinceMs = performance.now();
  }

  /** Seconds, to the hundredth. */
  seconds(): number {
    const runningMs = document.hidden ? 0 : performance.now() - this.sinceMs;
    return Math.round((this.beforeMs + runningMs) / 10) / 100;
  }
}
