/**
 * From latitude and longitude to metres: WGS84, geocentric and east-north-up.
 *
 * Heights are above the ellipsoid, not above the sea. The local frame ENU is the tangent frame at
 * a site's origin: x east, y north, z up along the ellipsoid's normal there.
 */
import { add, apply, subtract, transpose, type Mat3, type Vec3 } from "./vectors";

/** A WGS84 place (EPSG:4979): degrees, metres above the ellipsoid. */
export interface Geodetic {
  readonly latDeg: number;
  readonly lonDeg: number;
  readonly heightM: number;
}

const SEMI_MAJOR_M = 6_378_137;
const FLATTENING = 1 / 298.257_223_563;
const ECCENTRICITY_2 = FLATTENING * (2 - FLATTENING);
const RADIANS = Math.PI / 180;

export function ecefFromGeodetic({ latDeg, lonDeg, heightM }: Geodetic): Vec3 {
  const [lat, lon] = [latDeg * RADIANS, lonDeg * RADIANS];
  const normal = primeVertical(lat);
  const across = (normal + heightM) * Math.cos(lat);
  return [
    across * Math.cos(lon),
    across * Math.sin(lon),
    (normal * (1 - ECCENTRICITY_2) + heightM) * Math.sin(lat),
  ];
}

/** The place of a geocentric point, to a millionth of a millimetre near the earth's surface. */
export function geodeticFromEcef([x, y, z]: Vec3): Geodetic {
  const across = Math.hypot(x, y);
  let lat = Math.atan2(z, across * (1 - ECCENTRICITY_2));
  for (let round = 0; round < 8; round += 1) {
    const normal = primeVertical(lat);
    lat = Math.atan2(z + ECCENTRICITY_2 * normal * Math.sin(lat), across);
  }
  const normal = primeVertical(lat);
  // Along the normal, so that neither the equator nor a pole divides by zero.
  const heightM =
    across * Math.cos(lat) +
    z * Math.sin(lat) -
    normal * (1 - ECCENTRICITY_2 * Math.sin(lat) ** 2);
  return { latDeg: lat / RADIANS, lonDeg: Math.atan2(y, x) / RADIANS, heightM };
}

export class EnuFrame {
  private readonly origin: Vec3;
  private readonly enuFromEcef: Mat3;
  private readonly ecefFromEnu: Mat3;

  constructor(readonly place: Geodetic) {
    this.origin = ecefFromGeodetic(place);
    this.enuFromEcef = axesAt(place);
    this.ecefFromEnu = transpose(this.enuFromEcef);
  }

  /** Metres east, north and up of the origin. */
  position(place: Geodetic): Vec3 {
    return apply(this.enuFromEcef, subtract(ecefFromGeodetic(place), this.origin));
  }

  geodetic(pointInEnu: Vec3): Geodetic {
    return geodeticFromEcef(add(apply(this.ecefFromEnu, pointInEnu), this.origin));
  }

  /** The point of a level surface (metres above the ellipsoid) below or above a place in ENU. */
  onLevel(eastM: number, northM: number, levelM: number): Vec3 {
    const { latDeg, lonDeg } = this.geodetic([eastM, northM, levelM - this.place.heightM]);
    return this.position({ latDeg, lonDeg, heightM: levelM });
  }
}

/** Rows east, north, up of a place as geocentric unit vectors. */
function axesAt({ latDeg, lonDeg }: Geodetic): Mat3 {
  const [lat, lon] = [latDeg * RADIANS, lonDeg * RADIANS];
  return [
    [-Math.sin(lon), Math.cos(lon), 0],
    [-Math.sin(lat) * Math.cos(lon), -Math.sin(lat) * Math.sin(lon), Math.cos(lat)],
    [Math.cos(lat) * Math.cos(lon), Math.cos(lat) * Math.sin(lon), Math.sin(lat)],
  ];
}

function primeVertical(lat: number): number {
  return SEMI_MAJOR_M / Math.sqrt(1 - ECCENTRICITY_2 * Math.sin(lat) ** 2);
}
