/**
 * A typed place of a landmark, checked where it is typed: coordinates, height with its datum, and
 * whether the place can be meant at all. A landmark on another continent is a slip; if exchanging
 * latitude and longitude brings it to the site, that slip is named.
 */
import { EnuFrame, type Geodetic } from "../../geometry/geodesy";
import { parseAngle, parseNumber, splitPair } from "./coordinates";

export type Datum = "ellipsoid" | "water";

export interface TypedPlace {
  readonly lat: string;
  readonly lon: string;
  readonly height: string;
  readonly datum: Datum;
}

export interface PlaceErrors {
  readonly lat?: string;
  readonly lon?: string;
  readonly height?: string;
  /** Latitude and longitude would be near the site the other way round. */
  readonly isExchanged?: boolean;
}

export type CheckedPlace =
  | { readonly place: Geodetic; readonly errors?: undefined }
  | { readonly errors: PlaceErrors };

/** A camera sees landmarks some kilometres away; a lighthouse or a mountain perhaps fifty. */
const FARTHEST_M = 50_000;
const HEIGHT_RANGE_M = { least: -500, most: 9_000 } as const;

export function checkPlace(typed: TypedPlace, frame: EnuFrame, waterLevelM: number): CheckedPlace {
  const [latText, lonText] = typed.lon.trim() === "" ? (splitPair(typed.lat) ?? [typed.lat, typed.lon]) : [typed.lat, typed.lon];
  const lat = parseAngle(latText, "lat");
  const lon = parseAngle(lonText, "lon");
  const height = parseNumber(typed.height, "the height in metres, for example 4.2");
  const errors: Record<string, string> = {};
  for (const [field, parsed] of Object.entries({ lat, lon, height })) {
    if (parsed.error !== undefined) {
      errors[field] = parsed.error;
    }
  }
  if (lat.error !== undefined || lon.error !== undefined || height.error !== undefined) {
    return { errors };
  }
  const heightM = height.value + (typed.datum === "water" ? waterLevelM : 0);
  if (heightM < HEIGHT_RANGE_M.least || heightM > HEIGHT_RANGE_M.most) {
    return { errors: { height: `A height of ${heightM.toFixed(0)} m above the ellipsoid is nowhere on earth; check the number and its datum.` } };
  }
  const place = { latDeg: lat.value, lonDeg: lon.value, heightM };
  return farErrors(place, frame) ?? { place };
}

function farErrors(place: Geodetic, frame: EnuFrame): CheckedPlace | null {
  const away = distanceFrom(frame, place);
  if (away <= FARTHEST_M) {
    return null;
  }
  const far = `This place is ${Math.round(away / 1000).toLocaleString("en-GB")} km from the site`;
  if (Math.abs(place.lonDeg) <= 90) {
    const exchanged = { ...place, latDeg: place.lonDeg, lonDeg: place.latDeg };
    if (distanceFrom(frame, exchanged) <= FARTHEST_M) {
      return { errors: { lat: `${far}: latitude and longitude seem exchanged.`, isExchanged: true } };
    }
  }
  return { errors: { lat: `${far}; check latitude and longitude.` } };
}

/** Metres between a place and the site's origin, along the straight line. */
export function distanceFrom(frame: EnuFrame, place: Geodetic): number {
  return Math.hypot(...frame.position(place));
}
