/** Where a vessel was at a moment: between two reports, or where it was last heard. */
import type { Points } from "./track-store";

export interface AtMoment {
  readonly x: number;
  readonly y: number;
  /** Degrees; null where neither heading nor, in motion, course is known. */
  readonly headingDeg: number | null;
  readonly isCourse: boolean;
  readonly sogKn: number | null;
  /** Seconds since it was heard, where nothing was heard after it for a while. */
  readonly silentS: number;
  /** The index of the last point at or before the moment. */
  readonly index: number;
}

/** Slower than this a course says nothing of where the bow points. */
const DRIFTING_KN = 0.5;

/** The index of the last value that is not after `wanted`; -1 where all are. */
export function lastBefore(times: readonly number[], wanted: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? Infinity) <= wanted) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low - 1;
}

/** Null for a vessel that was not heard for longer than `silenceS`, or not yet. */
export function atMoment(points: Points, momentS: number, silenceS: number): AtMoment | null {
  const index = lastBefore(points.t, momentS);
  const since = momentS - (points.t[index] ?? -Infinity);
  if (since > silenceS) {
    return null;
  }
  const step = (points.t[index + 1] ?? Infinity) - (points.t[index] ?? 0);
  const isBetween = step <= silenceS;
  const share = isBetween ? since / step : 0;
  const sog = points.sog[index] ?? -1;
  const from = direction(points, index);
  const to = isBetween ? direction(points, index + 1) : null;
  return {
    x: between(points.x, index, share),
    y: between(points.y, index, share),
    headingDeg: from === null || to === null ? from : turned(from, to, share),
    isCourse: (points.heading[index] ?? -1) < 0,
    sogKn: sog < 0 ? null : sog / 10,
    silentS: isBetween ? 0 : since,
    index,
  };
}

function between(values: readonly number[], index: number, share: number): number {
  const from = values[index] ?? 0;
  return share === 0 ? from : from + ((values[index + 1] ?? from) - from) * share;
}

function direction(points: Points, index: number): number | null {
  const heading = points.heading[index] ?? -1;
  if (heading >= 0) {
    return heading;
  }
  const course = points.cog[index] ?? -1;
  return course >= 0 && (points.sog[index] ?? -1) >= DRIFTING_KN * 10 ? course : null;
}

/** The short way round. */
function turned(fromDeg: number, toDeg: number, share: number): number {
  const turn = ((toDeg - fromDeg + 540) % 360) - 180;
  return (fromDeg + turn * share + 360) % 360;
}
