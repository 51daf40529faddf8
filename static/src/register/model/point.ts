/**
 * A keypoint while it is edited: a landmark's place in the world, the pixel at which it is seen, or
 * for a while only one of the two.
 *
 * Points are values and never changed: an edit makes a new list, and undoing goes back to the list
 * before. A point has a key of its own, because neither its landmark nor its name is settled yet.
 */
import type { Geodetic } from "../../geometry/geodesy";
import type { Pixel } from "../../geometry/camera";

export const ROLES = ["control", "check", "off"] as const;
export type Role = (typeof ROLES)[number];

export interface Point {
  readonly key: string;
  /** The landmark of the site that it shows; null while it is a new one. */
  readonly landmarkId: number | null;
  readonly name: string;
  readonly place: Geodetic | null;
  readonly pixel: Pixel | null;
  readonly role: Role;
}

/** A point that can be solved and saved. */
export interface CompletePoint extends Point {
  readonly place: Geodetic;
  readonly pixel: Pixel;
}

export type Points = readonly Point[];

export interface Landmark {
  readonly id: number;
  readonly name: string;
  readonly place: Geodetic;
  readonly viewportCount: number;
  readonly version: number;
}

/** A keypoint as REST speaks of it. */
export interface KeypointJson {
  readonly landmark_id: number | null;
  readonly name: string;
  readonly lat_deg: number;
  readonly lon_deg: number;
  readonly height_m: number;
  readonly u_px: number;
  readonly v_px: number;
  readonly role: Role;
}

export function isComplete(point: Point): point is CompletePoint {
  return point.place !== null && point.pixel !== null;
}

/** The keypoint of a landmark has the same key in every load, so that drafts and edits meet. */
export function fromJson(item: KeypointJson): CompletePoint {
  return {
    key: keyOfLandmark(item.landmark_id, item.name),
    landmarkId: item.landmark_id,
    name: item.name,
    place: { latDeg: item.lat_deg, lonDeg: item.lon_deg, heightM: item.height_m },
    pixel: [item.u_px, item.v_px],
    role: item.role,
  };
}

export function toJson(point: CompletePoint): KeypointJson {
  return {
    landmark_id: point.landmarkId,
    name: point.name,
    lat_deg: point.place.latDeg,
    lon_deg: point.place.lonDeg,
    height_m: point.place.heightM,
    u_px: point.pixel[0],
    v_px: point.pixel[1],
    role: point.role,
  };
}

export function fromLandmark(landmark: Landmark, pixel: Pixel | null): Point {
  return {
    key: keyOfLandmark(landmark.id, landmark.name),
    landmarkId: landmark.id,
    name: landmark.name,
    place: landmark.place,
    pixel,
    role: "control",
  };
}

function keyOfLandmark(id: number | null, name: string): string {
  return id === null ? `name-${name}` : `landmark-${id}`;
}

/** The first free name of the kind "Point 7". */
export function freeName(taken: Iterable<string>): string {
  const names = new Set(taken);
  let number = 1;
  while (names.has(`Point ${number}`)) {
    number += 1;
  }
  return `Point ${number}`;
}

export function samePoint(a: Point, b: Point): boolean {
  return (
    a.name === b.name &&
    a.role === b.role &&
    a.landmarkId === b.landmarkId &&
    samePlace(a.place, b.place) &&
    a.pixel?.[0] === b.pixel?.[0] &&
    a.pixel?.[1] === b.pixel?.[1]
  );
}

export function samePlace(a: Geodetic | null, b: Geodetic | null): boolean {
  return a?.latDeg === b?.latDeg && a?.lonDeg === b?.lonDeg && a?.heightM === b?.heightM;
}

export function samePoints(a: Points, b: Points): boolean {
  return (
    a.length === b.length &&
    a.every((point) => {
      const other = b.find(({ key }) => key === point.key);
      return other !== undefined && samePoint(point, other);
    })
  );
}
