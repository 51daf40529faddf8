/** SVG path data in screen pixels from geometry points; points that are not finite draw nothing. */
import { toScreen, type Point, type Rect, type View } from "../view";
import type { Segment } from "./box";

export function polygonPath(points: readonly Point[], view: View): string {
  if (points.length < 3 || points.some(([u, v]) => !Number.isFinite(u) || !Number.isFinite(v))) {
    return "";
  }
  return `M${points.map((point) => at(point, view)).join("L")}Z`;
}

/** An open line through all its points. */
export function linePath(points: readonly Point[], view: View): string {
  return points.length < 2 ? "" : `M${points.map((point) => at(point, view)).join("L")}`;
}

export function segmentsPath(segments: readonly Segment[], view: View): string {
  return segments.map(([a, b]) => `M${at(a, view)}L${at(b, view)}`).join("");
}

export function rectPath({ x1, y1, x2, y2 }: Rect, view: View): string {
  return polygonPath(
    [
      [x1, y1],
      [x2, y1],
      [x2, y2],
      [x1, y2],
    ],
    view,
  );
}

/** An arrow head at the end of a segment, its size in screen pixels. */
export function arrowHead([from, to]: Segment, view: View, size: number): string {
  const [x1, y1] = toScreen(view, from);
  const [x2, y2] = toScreen(view, to);
  const length = Math.hypot(x2 - x1, y2 - y1);
  if (length < size) {
    return "";
  }
  const [dx, dy] = [((x2 - x1) / length) * size, ((y2 - y1) / length) * size];
  const wing = (side: number): string =>
    `${number(x2 - dx - side * dy * 0.5)} ${number(y2 - dy + side * dx * 0.5)}`;
  return `M${wing(1)}L${number(x2)} ${number(y2)}L${wing(-1)}`;
}

function at(point: Point, view: View): string {
  const [x, y] = toScreen(view, point);
  return `${number(x)} ${number(y)}`;
}

/** A hundredth of a pixel is finer than any screen shows. */
function number(value: number): string {
  return value.toFixed(2);
}
