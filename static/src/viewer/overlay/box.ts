/**
 * The projected 3D box of a vessel: which edges are seen, which lie behind, where its axes point.
 *
 * Only the eight corners in the image are needed. A face is seen when its corners, listed clockwise
 * as seen from outside, also run clockwise in the image; and the diagonals of a face cross where
 * its centre is projected, whatever the perspective. Corner order: 1 bow-port, 2 bow-starboard,
 * 3 stern-starboard, 4 stern-port at the bottom, 5 to 8 the top in the same order.
 */
import type { Point } from "../view";

/** Corner indices (from 0) of each face, clockwise as seen from outside. */
const FACES = {
  top: [4, 5, 6, 7],
  bottom: [0, 3, 2, 1],
  bow: [5, 4, 0, 1],
  stern: [7, 6, 2, 3],
  port: [4, 7, 3, 0],
  starboard: [6, 5, 1, 2],
} as const;

export type Face = keyof typeof FACES;
type Corner = (typeof FACES)[Face][number];
type Edge = readonly [Corner, Corner, Face, Face];

/** Each edge with the two faces that meet there. */
const EDGES: readonly Edge[] = [
  [0, 1, "bottom", "bow"],
  [1, 2, "bottom", "starboard"],
  [2, 3, "bottom", "stern"],
  [3, 0, "bottom", "port"],
  [4, 5, "top", "bow"],
  [5, 6, "top", "starboard"],
  [6, 7, "top", "stern"],
  [7, 4, "top", "port"],
  [0, 4, "bow", "port"],
  [1, 5, "bow", "starboard"],
  [2, 6, "stern", "starboard"],
  [3, 7, "stern", "port"],
];

export type Segment = readonly [Point, Point];

export interface BoxDrawing {
  readonly visibleEdges: readonly Segment[];
  readonly hiddenEdges: readonly Segment[];
  readonly bowFace: readonly Point[];
  readonly bowIsSeen: boolean;
  /** From the middle of the box to the middles of its bow, port and top faces. */
  readonly axes: { readonly forward: Segment; readonly port: Segment; readonly up: Segment };
}

type Corners = readonly [Point, Point, Point, Point, Point, Point, Point, Point];

/** What to draw for eight corners; null unless all are there and finite. */
export function drawBox(corners: readonly Point[]): BoxDrawing | null {
  if (!isComplete(corners)) {
    return null;
  }
  const seen = (face: Face): boolean => area(FACES[face].map((i) => corners[i])) > 0;
  const segment = ([a, b]: Edge): Segment => [corners[a], corners[b]];
  const isSeen = ([, , one, other]: Edge): boolean => seen(one) || seen(other);
  const middle = crossing(corners[0], corners[6], corners[1], corners[7]) ?? mean(corners);
  const to = (face: Face): Segment => [middle, faceMiddle(corners, face)];
  return {
    visibleEdges: EDGES.filter(isSeen).map(segment),
    hiddenEdges: EDGES.filter((edge) => !isSeen(edge)).map(segment),
    bowFace: FACES.bow.map((i) => corners[i]),
    bowIsSeen: seen("bow"),
    axes: { forward: to("bow"), port: to("port"), up: to("top") },
  };
}

/** Twice the signed area; positive when the points run clockwise with y pointing down. */
export function area(points: readonly Point[]): number {
  return points.reduce((sum, [x, y], i) => {
    const [nextX, nextY] = points[(i + 1) % points.length] ?? [x, y];
    return sum + x * nextY - nextX * y;
  }, 0);
}

/** Where the line a-b crosses the line c-d; null when they are nearly parallel. */
export function crossing(a: Point, b: Point, c: Point, d: Point): Point | null {
  const r: Point = [b[0] - a[0], b[1] - a[1]];
  const s: Point = [d[0] - c[0], d[1] - c[1]];
  const cross = r[0] * s[1] - r[1] * s[0];
  if (Math.abs(cross) < 1e-3 * Math.hypot(...r) * Math.hypot(...s)) {
    return null;
  }
  const along = ((c[0] - a[0]) * s[1] - (c[1] - a[1]) * s[0]) / cross;
  return [a[0] + along * r[0], a[1] + along * r[1]];
}

function faceMiddle(corners: Corners, face: Face): Point {
  const [a, b, c, d] = FACES[face];
  return (
    crossing(corners[a], corners[c], corners[b], corners[d]) ??
    mean(FACES[face].map((i) => corners[i]))
  );
}

function mean(points: readonly Point[]): Point {
  const sum = points.reduce<Point>(([x, y], [px, py]) => [x + px, y + py], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

function isComplete(corners: readonly Point[]): corners is Corners {
  return (
    corners.length === 8 &&
    corners.every(([u, v]) => Number.isFinite(u) && Number.isFinite(v))
  );
}
