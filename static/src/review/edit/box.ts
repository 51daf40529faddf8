/**
 * The box of a corrected pose: an upright cuboid that stands on the water, in metres of the level
 * east-north-up frame whose origin is the middle of the generated box's bottom.
 *
 * The browser projects it as the server does (tests/golden/pose_projection.json checks both), so
 * that the wireframe follows the hand without asking anyone. Corner order as everywhere: bow-port,
 * bow-starboard, stern-starboard, stern-port, then the top in the same order.
 */
import type { components } from "../../api-types";
import { project, type Camera } from "../../geometry/camera";
import type { Vec3 } from "../../geometry/vectors";
import type { Point } from "../../viewer/view";

export type LocalBox = components["schemas"]["LocalBox"];

export type Dimension = "length_m" | "width_m" | "height_m";

/** Smaller or larger is no vessel; the server refuses it too. */
const LEAST_M = 0.5;
const MOST_M: Readonly<Record<Dimension, number>> = { length_m: 600, width_m: 120, height_m: 150 };
const RADIANS = Math.PI / 180;
const NOWHERE: Point = [Number.NaN, Number.NaN];

/** A level direction; `away` points from the camera to the box, `across` to the right of that. */
export interface Bearings {
  readonly across: readonly [east: number, north: number];
  readonly away: readonly [east: number, north: number];
}

export function bearingsFrom(camera: Camera): Bearings {
  const [x, y] = camera.center;
  const range = Math.hypot(x, y);
  const away = range === 0 ? ([0, 1] as const) : ([-x / range, -y / range] as const);
  return { away, across: [away[1], -away[0]] };
}

/** Forward and port, unit vectors [east, north]. */
export function axesOf({ heading_deg: degrees }: LocalBox): {
  readonly forward: readonly [number, number];
  readonly port: readonly [number, number];
} {
  const [s, c] = [Math.sin(degrees * RADIANS), Math.cos(degrees * RADIANS)];
  return { forward: [s, c], port: [-c, s] };
}

/** The point `forward` half lengths, `port` half widths and `up` heights from the bottom's middle. */
export function pointOf(box: LocalBox, forward: number, port: number, up: number): Vec3 {
  const { forward: f, port: p } = axesOf(box);
  const along = (forward * box.length_m) / 2;
  const aside = (port * box.width_m) / 2;
  return [
    box.east_m + along * f[0] + aside * p[0],
    box.north_m + along * f[1] + aside * p[1],
    box.up_m + up * box.height_m,
  ];
}

export function cornersOf(box: LocalBox): readonly Vec3[] {
  return [0, 1].flatMap((up) =>
    ([[1, 1], [1, -1], [-1, -1], [-1, 1]] as const).map(([forward, port]) =>
      pointOf(box, forward, port, up),
    ),
  );
}

/** The eight corners in the image; NaN where one has no projection. */
export function projectBox(camera: Camera, box: LocalBox): readonly Point[] {
  return cornersOf(box).map((corner) => project(camera, corner) ?? NOWHERE);
}

export function movedBy(box: LocalBox, eastM: number, northM: number): LocalBox {
  return { ...box, east_m: box.east_m + eastM, north_m: box.north_m + northM };
}

/** Moves on the water as the camera sees it: to the right, and away from it. */
export function movedAlong(
  box: LocalBox,
  { across, away }: Bearings,
  acrossM: number,
  awayM: number,
): LocalBox {
  return movedBy(
    box,
    across[0] * acrossM + away[0] * awayM,
    across[1] * acrossM + away[1] * awayM,
  );
}

export function turnedTo(box: LocalBox, degrees: number): LocalBox {
  return { ...box, heading_deg: ((degrees % 360) + 360) % 360 };
}

/** Bow and stern change places. */
export function flipped(box: LocalBox): LocalBox {
  return turnedTo(box, box.heading_deg + 180);
}

export function resized(box: LocalBox, dimension: Dimension, metres: number): LocalBox {
  return { ...box, [dimension]: clampSize(dimension, metres) };
}

/** Moves one face, +1 the bow or port side and -1 its opposite, which stays where it is. */
export function stretched(
  box: LocalBox,
  dimension: "length_m" | "width_m",
  side: 1 | -1,
  metres: number,
): LocalBox {
  const grown = resized(box, dimension, metres);
  const half = (side * (grown[dimension] - box[dimension])) / 2;
  const axis = dimension === "length_m" ? axesOf(box).forward : axesOf(box).port;
  return movedBy(grown, axis[0] * half, axis[1] * half);
}

/** What a person changed: metres on the water as the camera sees it, degrees, metres of size. */
export interface Change {
  readonly across_m: number;
  readonly away_m: number;
  readonly heading_deg: number;
  readonly length_m: number;
  readonly width_m: number;
  readonly height_m: number;
}

export function changeBetween(from: LocalBox, to: LocalBox, { across, away }: Bearings): Change {
  const [east, north] = [to.east_m - from.east_m, to.north_m - from.north_m];
  return {
    across_m: east * across[0] + north * across[1],
    away_m: east * away[0] + north * away[1],
    heading_deg: turnBetween(from.heading_deg, to.heading_deg),
    length_m: to.length_m - from.length_m,
    width_m: to.width_m - from.width_m,
    height_m: to.height_m - from.height_m,
  };
}

/** The shorter way from one heading to another, clockwise positive, -180 to 180 degrees. */
export function turnBetween(fromDeg: number, toDeg: number): number {
  const turn = (((toDeg - fromDeg) % 360) + 360) % 360;
  return turn > 180 ? turn - 360 : turn;
}

function clampSize(dimension: Dimension, metres: number): number {
  return Math.min(MOST_M[dimension], Math.max(LEAST_M, metres));
}
