/**
 * Draws what lies around the poses of an image: where AIS has other vessels, where the sea ends,
 * and which vessels people marked as missed.
 */
import type { Overlay } from "../viewer";
import { middle, type Point, type Rect, type View } from "../view";
import { Lines } from "./lines";
import { linePath, polygonPath, rectPath } from "./paths";

/** A vessel that AIS knows of: its plane on the water and what is said of it. */
export interface DrawnVessel {
  readonly words: string;
  readonly segment: readonly Point[];
}

/** A vessel that a person marked. */
export interface DrawnMissed {
  readonly id: number;
  readonly rect: Rect;
  readonly words: string;
}

export interface DrawnSurroundings {
  readonly vessels: readonly DrawnVessel[];
  readonly missed: readonly DrawnMissed[];
  readonly horizon: readonly (readonly Point[])[];
}

export class SurroundingsOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  set({ vessels, missed, horizon }: DrawnSurroundings): void {
    const { lines } = this;
    if (lines === null) {
      return;
    }
    lines.clear();
    const around = lines.group("overlay-around");
    for (const piece of horizon) {
      lines.add(around, "layer-horizon", (view) => linePath(piece, view));
    }
    for (const { words, segment } of vessels) {
      lines.add(around, "layer-vessels", (view) => polygonPath(segment, view));
      lines.label(around, "layer-vessels", words, topOf(segment));
    }
    for (const { id, rect, words } of missed) {
      const group = lines.group("overlay-missed");
      group.dataset["missed"] = String(id);
      lines.add(group, "layer-missed", (view) => rectPath(rect, view));
      lines.label(group, "layer-missed", words, [middle(rect)[0], rect.y1]);
    }
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }
}

/** Where a label stands: above the highest point, in the middle. */
function topOf(points: readonly Point[]): Point {
  const us = points.map(([u]) => u);
  return [(Math.min(...us) + Math.max(...us)) / 2, Math.min(...points.map(([, v]) => v))];
}
