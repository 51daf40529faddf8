/** What the drawing screen says beside the photograph, and which box a click means. */
import { contains } from "../review/missed/missed-box";
import type { Point, Rect } from "../viewer/view";
import type { Board } from "./board";
import type { VesselClass } from "./scene";

export function hintFor({ pending, chosen }: Board, lastClass: VesselClass): string {
  if (pending !== null) {
    return `Which class? One key stores it; drawing on takes ${lastClass}.`;
  }
  return chosen === null
    ? "Drag a box around every vessel, then press its class."
    : "Drag it or its corners, press another class, or delete it.";
}

/** The smallest box under a point: a vessel of a convoy before the convoy. */
export function smallestAt({ boxes }: Board, at: Point): Board["chosen"] {
  const area = ({ x1, y1, x2, y2 }: Rect): number => (x2 - x1) * (y2 - y1);
  const under = boxes.filter(({ rect }) => contains(rect, at));
  return under.sort((a, b) => area(a.rect) - area(b.rect))[0] ?? null;
}
