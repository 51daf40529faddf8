/**
 * The box around a missed vessel while it is drawn, moved and stretched: pure geometry in pixels of
 * the image, which it never leaves.
 */
import type { Point, Rect, Size } from "../../viewer/view";

/** Smaller is a slip of the hand. */
export const LEAST_SIZE_PX = 4;

export type Corner = "top-left" | "top-right" | "bottom-right" | "bottom-left";
export const CORNERS: readonly Corner[] = ["top-left", "top-right", "bottom-right", "bottom-left"];

export function rectBetween([ax, ay]: Point, [bx, by]: Point, image: Size): Rect {
  const a = inside([ax, ay], image);
  const b = inside([bx, by], image);
  return {
    x1: Math.min(a[0], b[0]),
    y1: Math.min(a[1], b[1]),
    x2: Math.max(a[0], b[0]),
    y2: Math.max(a[1], b[1]),
  };
}

export function isLargeEnough({ x1, y1, x2, y2 }: Rect): boolean {
  return x2 - x1 >= LEAST_SIZE_PX && y2 - y1 >= LEAST_SIZE_PX;
}

export function cornerOf({ x1, y1, x2, y2 }: Rect, corner: Corner): Point {
  return [corner.endsWith("left") ? x1 : x2, corner.startsWith("top") ? y1 : y2];
}

export function oppositeOf(corner: Corner): Corner {
  return CORNERS[(CORNERS.indexOf(corner) + 2) % 4] ?? corner;
}

/** Moved as a whole, as far as the image's border. */
export function movedRect(rect: Rect, dx: number, dy: number, image: Size): Rect {
  const x = Math.min(image.width - 0.5 - rect.x2, Math.max(-0.5 - rect.x1, dx));
  const y = Math.min(image.height - 0.5 - rect.y2, Math.max(-0.5 - rect.y1, dy));
  return { x1: rect.x1 + x, y1: rect.y1 + y, x2: rect.x2 + x, y2: rect.y2 + y };
}

/** Wider and higher about its middle. */
export function grownRect({ x1, y1, x2, y2 }: Rect, dx: number, dy: number, image: Size): Rect {
  const [midX, midY] = [(x1 + x2) / 2, (y1 + y2) / 2];
  const half = (extent: number, by: number): number => Math.max(LEAST_SIZE_PX, extent + by) / 2;
  const [w, h] = [half(x2 - x1, dx), half(y2 - y1, dy)];
  return rectBetween([midX - w, midY - h], [midX + w, midY + h], image);
}

export function contains({ x1, y1, x2, y2 }: Rect, [x, y]: Point): boolean {
  return x >= x1 && x <= x2 && y >= y1 && y <= y2;
}

/** Pixels reach half of one beyond their centres. */
function inside([x, y]: Point, { width, height }: Size): Point {
  return [
    Math.min(width - 0.5, Math.max(-0.5, x)),
    Math.min(height - 0.5, Math.max(-0.5, y)),
  ];
}
