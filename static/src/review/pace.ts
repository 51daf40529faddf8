/** How fast a reviewer works, from the last few decisions, and how long the rest would take. */
const REMEMBERED = 30;
const NEEDED = 3;

export class Pace {
  private readonly seconds: number[] = [];
  private decisions = 0;

  /** How many decisions were made in this sitting and not taken back. */
  get count(): number {
    return this.decisions;
  }

  takeBack(): void {
    this.decisions = Math.max(0, this.decisions - 1);
  }

  add(seconds: number): void {
    this.decisions += 1;
    this.seconds.push(seconds);
    if (this.seconds.length > REMEMBERED) {
      this.seconds.shift();
    }
  }

  /** The median: one long look at a hard case does not spoil the forecast. Null while too few. */
  secondsPerPose(): number | null {
    if (this.seconds.length < NEEDED) {
      return null;
    }
    const sorted = this.seconds.toSorted((a, b) => a - b);
    const half = Math.floor(sorted.length / 2);
    const upper = sorted[half] ?? 0;
    return sorted.length % 2 === 1 ? upper : (upper + (sorted[half - 1] ?? upper)) / 2;
  }

  remainingS(left: number): number | null {
    const each = this.secondsPerPose();
    return each === null ? null : each * left;
  }
}
