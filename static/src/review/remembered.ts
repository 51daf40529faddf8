/**
 * The last decisions of a run, kept in this browser, so that they can be reopened and undone after
 * a reload as well.
 */
import type { Remembered } from "./session";
import type { Decision } from "./verdicts";

const PREFIX = "quaymark.decisions.";

export class RememberedDecisions {
  private readonly name: string;

  constructor(user: string, runId: number) {
    this.name = `${PREFIX}${user}.${runId}`;
  }

  read(): readonly Decision[] {
    try {
      const kept: unknown = JSON.parse(localStorage.getItem(this.name) ?? "[]");
      return Array.isArray(kept) ? (kept as Decision[]) : [];
    } catch {
      return [];
    }
  }

  /** Keeps what the strip shows. */
  keep(strip: readonly Remembered[]): void {
    try {
      const oldestFirst = strip.map(({ decision }) => decision).toReversed();
      localStorage.setItem(this.name, JSON.stringify(oldestFirst));
    } catch {
      // Without storage they last until the page is left.
    }
  }
}
