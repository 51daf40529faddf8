/** How fast bytes go, by the last seconds only, and how long the rest will take. */
import { duration, number } from "../format";

const WINDOW_MS = 15_000;

export class Pace {
  private readonly marks: { readonly at: number; readonly bytes: number }[] = [];

  note(at: number, bytes: number): void {
    this.marks.push({ at, bytes });
    while (this.marks.length > 2 && at - (this.marks[0]?.at ?? at) > WINDOW_MS) {
      this.marks.shift();
    }
  }

  /** Bytes a second; null before two moments are known. */
  rate(): number | null {
    const first = this.marks[0];
    const last = this.marks.at(-1);
    if (first === undefined || last === undefined || last.at <= first.at) {
      return null;
    }
    return ((last.bytes - first.bytes) * 1000) / (last.at - first.at);
  }
}

export function megabytes(bytes: number): string {
  return number(bytes / 1e6, bytes < 1e8 ? 1 : 0);
}

/** `12.3 MB/s, 4 min 05 s left`. */
export function told(rate: number | null, leftBytes: number): string {
  if (rate === null || rate <= 0) {
    return "";
  }
  return `${megabytes(rate)} MB/s, ${duration(leftBytes / rate)} left`;
}
