/**
 * Drawing traffic on a canvas: tracks as thin lines, vessels as small ships pointing their way.
 *
 * Steps shorter than a pixel are left out, and tracks can be drawn some at a time. Class A is
 * filled, class B is an outline; a doubtful vessel has a ring, so that nothing is told by colour
 * alone.
 */
import type { AtMoment } from "./moment";
import { lastBefore } from "./moment";
import type { Palette } from "./palette";
import type { Sprites } from "./sprites";
import type { Track } from "./track-store";

/** Where a canvas lies in the world: pixels of the whole world, and those of its corner. */
export interface Frame {
  readonly worldPx: number;
  readonly leftPx: number;
  readonly topPx: number;
  readonly widthPx: number;
  readonly heightPx: number;
}

export interface Present {
  readonly track: Track;
  readonly at: AtMoment;
}

const LEAST_STEP_PX = 1.5;
const MARGIN_PX = 20;
const MOST_NAMES = 60;
const NAME_HEIGHT_PX = 15;

export interface Span {
  readonly fromS: number;
  readonly toS: number;
  readonly silenceS: number;
}

/** Draws the tracks from one index on until so many points are drawn; returns where to go on. */
export function drawTracks(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  tracks: readonly Track[],
  span: Span,
  chosen: Track | null,
  palette: Palette,
  first: number,
  most: number,
): number {
  pen.lineJoin = "round";
  pen.lineWidth = 1.1;
  pen.strokeStyle = palette.track;
  let drawn = 0;
  let next = first;
  for (; next < tracks.length && drawn < most; next += 1) {
    const track = tracks[next];
    if (track !== undefined && track !== chosen) {
      pen.beginPath();
      drawn += trace(pen, frame, track, span);
      pen.stroke();
    }
  }
  if (next >= tracks.length && chosen !== null) {
    pen.lineWidth = 2.2;
    pen.strokeStyle = palette.chosen;
    pen.beginPath();
    trace(pen, frame, chosen, span);
    pen.stroke();
  }
  return next;
}

function trace(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  { t, x, y }: Track,
  { fromS, toS, silenceS }: Span,
): number {
  const { worldPx, leftPx, topPx } = frame;
  const last = lastBefore(t, toS);
  let before = -Infinity;
  let drawn = 0;
  let [drawnX, drawnY] = [0, 0];
  for (let index = Math.max(0, lastBefore(t, fromS)); index <= last; index += 1) {
    const time = t[index] ?? 0;
    const pointX = (x[index] ?? 0) * worldPx - leftPx;
    const pointY = (y[index] ?? 0) * worldPx - topPx;
    const isShort = Math.abs(pointX - drawnX) + Math.abs(pointY - drawnY) < LEAST_STEP_PX;
    if (time - before > silenceS) {
      pen.moveTo(pointX, pointY);
      [drawnX, drawnY] = [pointX, pointY];
    } else if (!isShort || index === last) {
      pen.lineTo(pointX, pointY);
      [drawnX, drawnY] = [pointX, pointY];
      drawn += 1;
    }
    before = time;
  }
  const next = t[last + 1];
  if (last >= 0 && next !== undefined && next - before <= silenceS) {
    const share = (toS - before) / (next - before);
    const reached = (values: readonly number[]): number => {
      const [from, to] = [values[last] ?? 0, values[last + 1] ?? 0];
      return (from + share * (to - from)) * worldPx;
    };
    pen.lineTo(reached(x) - leftPx, reached(y) - topPx); // up to where the vessel is drawn
  }
  return drawn;
}

export function placeOf(frame: Frame, at: AtMoment): readonly [number, number] {
  return [at.x * frame.worldPx - frame.leftPx, at.y * frame.worldPx - frame.topPx];
}

export function drawVessels(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  present: readonly Present[],
  chosen: Track | null,
  palette: Palette,
  sprites: Sprites,
  quietS: number,
): void {
  pen.clearRect(0, 0, frame.widthPx, frame.heightPx);
  const inSight = present.filter(({ at }) => isInSight(frame, at));
  for (const isSilent of [false, true]) {
    pen.globalAlpha = isSilent ? 0.55 : 1;
    for (const { track, at } of inSight) {
      if ((at.silentS > quietS) === isSilent) {
        const [x, y] = placeOf(frame, at);
        sprites.put(pen, x, y, at.headingDeg, track.about.ais_class === "B");
      }
    }
  }
  pen.globalAlpha = 1;
  rings(pen, frame, inSight.filter(({ track }) => track.flags.size > 0), 9, palette.flagged);
  rings(pen, frame, inSight.filter(({ track }) => track === chosen), 13, palette.chosen);
  drawNames(pen, frame, inSight, chosen, palette);
}

function isInSight(frame: Frame, at: AtMoment): boolean {
  const [x, y] = placeOf(frame, at);
  return (
    x > -MARGIN_PX && y > -MARGIN_PX && x < frame.widthPx + MARGIN_PX && y < frame.heightPx + MARGIN_PX
  );
}

function rings(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  present: readonly Present[],
  radius: number,
  colour: string,
): void {
  pen.beginPath();
  for (const { at } of present) {
    const [x, y] = placeOf(frame, at);
    pen.moveTo(x + radius, y);
    pen.arc(x, y, radius, 0, 2 * Math.PI);
  }
  pen.lineWidth = 2;
  pen.strokeStyle = colour;
  pen.stroke();
}

/** Names where there is room: not over each other, and none at all over a crowd. */
function drawNames(
  pen: CanvasRenderingContext2D,
  frame: Frame,
  present: readonly Present[],
  chosen: Track | null,
  palette: Palette,
): void {
  const named = present.length <= MOST_NAMES ? present : present.filter(({ track }) => track === chosen);
  pen.font = "13px system-ui, sans-serif";
  pen.textBaseline = "middle";
  pen.lineWidth = 3;
  pen.strokeStyle = palette.casing;
  pen.fillStyle = palette.text;
  const taken: (readonly [number, number, number])[] = [];
  for (const { track, at } of named) {
    const [x, y] = placeOf(frame, at);
    const text = titleOf(track);
    const width = text.length * 7.5;
    const isFree = taken.every(
      ([otherX, otherY, otherWidth]) =>
        Math.abs(y - otherY) >= NAME_HEIGHT_PX || x + width < otherX || otherX + otherWidth < x,
    );
    if (isFree || track === chosen) {
      taken.push([x, y, width]);
      pen.strokeText(text, x + 12, y);
      pen.fillText(text, x + 12, y);
    }
  }
}

export function titleOf({ id, about }: Track): string {
  const name = (about.name ?? "").trim();
  return name !== "" ? name : String(id);
}
