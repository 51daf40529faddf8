/**
 * What importing a file would do, before it is done: each line new, changed, unchanged or wrong,
 * with the reason. Names decide what belongs together, as on the server.
 */
import { isInImage, type Intrinsics, type Pixel } from "../../geometry/camera";
import type { EnuFrame, Geodetic } from "../../geometry/geodesy";
import { distanceFrom } from "../model/place-entry";
import { samePlace, type Landmark, type Point, type Points, type Role } from "../model/point";

export interface ImportedPoint {
  readonly name: string;
  readonly role: Role;
  readonly place: Geodetic | null;
  readonly pixel: Pixel | null;
}

export type ImportLine =
  | { readonly line: number; readonly point: ImportedPoint; readonly error?: undefined }
  | { readonly line: number; readonly error: string; readonly point?: undefined };

export type Effect = "new" | "changes" | "unchanged";

export interface PlannedLine {
  readonly line: number;
  readonly name: string;
  readonly effect: Effect | "error";
  readonly note: string;
}

export interface ImportPlan {
  readonly lines: readonly PlannedLine[];
  readonly errors: number;
  readonly changes: number;
  /** All points afterwards, if the lines without errors are taken. */
  readonly points: Points;
}

export interface ImportWorld {
  readonly points: Points;
  readonly landmarks: readonly Landmark[];
  readonly frame: EnuFrame;
  readonly intrinsics: Intrinsics;
}

const FARTHEST_M = 50_000;
const SAME_M = 0.005;

export function planImport(lines: readonly ImportLine[], world: ImportWorld): ImportPlan {
  const points = [...world.points];
  const seen = new Map<string, number>();
  const planned = lines.map((entry): PlannedLine => {
    const { line } = entry;
    if (entry.error !== undefined) {
      return { line, name: "", effect: "error", note: entry.error };
    }
    const { point } = entry;
    const problem = problemOf(point, world, seen.get(point.name));
    if (problem !== null) {
      return { line, name: point.name, effect: "error", note: problem };
    }
    seen.set(point.name, line);
    return { line, name: point.name, ...merge(point, points, world) };
  });
  return {
    lines: planned,
    errors: planned.filter(({ effect }) => effect === "error").length,
    changes: planned.filter(({ effect }) => effect === "new" || effect === "changes").length,
    points,
  };
}

function problemOf(point: ImportedPoint, world: ImportWorld, before: number | undefined): string | null {
  if (before !== undefined) {
    return `The name stands in line ${before} already; names are unique.`;
  }
  if (point.pixel !== null && !isInImage(world.intrinsics, point.pixel)) {
    const { widthPx, heightPx } = world.intrinsics;
    return `(${point.pixel.join(", ")}) lies outside of the image of ${widthPx} × ${heightPx} px.`;
  }
  if (point.place !== null) {
    const away = distanceFrom(world.frame, point.place);
    if (away > FARTHEST_M) {
      const swapped = { ...point.place, latDeg: point.place.lonDeg, lonDeg: point.place.latDeg };
      const isSwapped = Math.abs(swapped.latDeg) <= 90 && distanceFrom(world.frame, swapped) <= FARTHEST_M;
      return `${Math.round(away / 1000)} km from the site${isSwapped ? ": latitude and longitude are exchanged" : ""}.`;
    }
    return null;
  }
  const isKnown =
    world.landmarks.some(({ name }) => name === point.name) ||
    world.points.some(({ name, place }) => name === point.name && place !== null);
  return isKnown ? null : "No landmark of the site has this name; give lat_deg, lon_deg and height_m.";
}

function merge(
  given: ImportedPoint,
  points: Point[],
  world: ImportWorld,
): { effect: Effect; note: string } {
  const landmark = world.landmarks.find(({ name }) => name === given.name) ?? null;
  const index = points.findIndex(({ name }) => name === given.name);
  const before = points[index];
  const known = before?.place ?? landmark?.place ?? null;
  const after: Point = {
    key: before?.key ?? (landmark === null ? `name-${given.name}` : `landmark-${landmark.id}`),
    landmarkId: before?.landmarkId ?? landmark?.id ?? null,
    name: given.name,
    place: given.place ?? known,
    pixel: given.pixel ?? before?.pixel ?? null,
    role: given.role,
  };
  const moved = known === null || given.place === null ? 0 : apart(known, given.place, world.frame);
  const note = moved > SAME_M ? `moves the landmark by ${moved.toFixed(moved < 10 ? 2 : 0)} m` : "";
  if (before === undefined) {
    points.push(after);
    return { effect: "new", note: [after.pixel === null ? "waits for its pixel" : "", note].filter(Boolean).join("; ") };
  }
  const isSame =
    samePlace(before.place, after.place) &&
    before.role === after.role &&
    before.pixel?.[0] === after.pixel?.[0] &&
    before.pixel?.[1] === after.pixel?.[1];
  points[index] = after;
  return isSame ? { effect: "unchanged", note: "" } : { effect: "changes", note };
}

function apart(a: Geodetic, b: Geodetic, frame: EnuFrame): number {
  const [p, q] = [frame.position(a), frame.position(b)];
  return Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}
