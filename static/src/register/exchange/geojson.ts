/**
 * Keypoints as GeoJSON (RFC 7946): a point a landmark, `[longitude, latitude, ellipsoidal height]`,
 * with name, role and pixel as properties, as QGIS and the like read and write it.
 */
import { isComplete, ROLES, type Point, type Role } from "../model/point";
import type { ImportLine } from "./import-plan";

export function writeGeoJson(points: readonly Point[]): string {
  const features = points
    .filter(({ place }) => place !== null)
    .map((point) => ({
      type: "Feature",
      geometry: {
        type: "Point",
        coordinates: [point.place?.lonDeg, point.place?.latDeg, point.place?.heightM],
      },
      properties: {
        name: point.name,
        ...(isComplete(point) ? { u_px: point.pixel[0], v_px: point.pixel[1] } : {}),
        role: point.role,
      },
    }));
  return `${JSON.stringify({ type: "FeatureCollection", features }, null, 1)}\n`;
}

/** The features of a collection; `line` counts features from 1. */
export function readGeoJson(text: string): ImportLine[] {
  let parsed: unknown;
  try {
    parsed = JSON.parse(text);
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    return [{ line: 1, error: `The file is no JSON: ${why}` }];
  }
  const features = isRecord(parsed) ? parsed["features"] : undefined;
  if (!Array.isArray(features)) {
    return [{ line: 1, error: "The file is no FeatureCollection of points." }];
  }
  return features.map((feature: unknown, index) => readFeature(feature, index + 1));
}

function readFeature(feature: unknown, line: number): ImportLine {
  const geometry = isRecord(feature) ? feature["geometry"] : null;
  const given = isRecord(feature) ? feature["properties"] : null;
  const properties = isRecord(given) ? given : {};
  const [lonDeg, latDeg, heightM] =
    isRecord(geometry) && geometry["type"] === "Point" && Array.isArray(geometry["coordinates"])
      ? (geometry["coordinates"] as unknown[])
      : [];
  const name = typeof properties["name"] === "string" ? properties["name"].trim() : "";
  const role = properties["role"] ?? "control";
  const [u, v] = [properties["u_px"], properties["v_px"]];
  if (name === "") {
    return { line, error: "The property “name” is missing." };
  }
  if (!isNumber(lonDeg) || !isNumber(latDeg) || Math.abs(latDeg) > 90 || Math.abs(lonDeg) > 180) {
    return { line, error: `${name}: the geometry is no point [longitude, latitude, height].` };
  }
  if (!isNumber(heightM)) {
    return { line, error: `${name}: the height (third coordinate, metres above the ellipsoid) is missing.` };
  }
  if (!isRole(role)) {
    return { line, error: `${name}: the role is none of ${ROLES.join(", ")}.` };
  }
  const pixel = isNumber(u) && isNumber(v) ? ([u, v] as const) : null;
  return { line, point: { name, role, place: { latDeg, lonDeg, heightM }, pixel } };
}

function isRole(value: unknown): value is Role {
  return (ROLES as readonly unknown[]).includes(value);
}

function isNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
