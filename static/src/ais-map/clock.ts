/** The moment that the map shows: set by a slider, the keyboard or time itself while it plays. */

export const DAY_S = 86_400;
const LONGEST_FRAME_S = 0.25;

export class Clock {
  isPlaying = false;
  /** Whether the moment is now, and moves on with it. */
  isLive = false;
  /** Seconds of traffic in a second. */
  speed = 60;
  private lastMs = 0;

  constructor(
    public momentS: number,
    public windowS: number,
    private readonly onChange: () => void,
    private readonly onStopped: () => void,
  ) {}

  get dayStartS(): number {
    return Math.floor(this.momentS / DAY_S) * DAY_S;
  }

  set(momentS: number): void {
    this.isLive = false;
    this.momentS = momentS;
    this.onChange();
  }

  follow(nowS: number): void {
    this.isPlaying = false;
    this.isLive = true;
    this.momentS = nowS;
    this.onChange();
  }

  step(seconds: number): void {
    this.set(this.momentS + seconds);
  }

  setWindow(windowS: number): void {
    this.windowS = windowS;
    this.onChange();
  }

  toggle(): void {
    if (this.isPlaying) {
      this.stop();
      return;
    }
    this.isPlaying = true;
    this.isLive = false;
    this.lastMs = performance.now();
    requestAnimationFrame(this.tick);
  }

  stop(): void {
    this.isPlaying = false;
    this.onStopped();
  }

  private readonly tick = (nowMs: number): void => {
    if (!this.isPlaying) {
      return;
    }
    // A page that was in the background goes on where it was.
    const passedS = Math.min(LONGEST_FRAME_S, Math.max(0, (nowMs - this.lastMs) / 1000));
    this.lastMs = nowMs;
    this.set(this.momentS + passedS * this.speed);
    requestAnimationFrame(this.tick);
  };
}
