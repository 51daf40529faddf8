/**
 * The frame of a small map: metres east and north of the camera on a few hundred pixels, north up,
 * with all that matters in sight and a scale bar of a round length.
 */

export type Metres = readonly [east: number, north: number];

export interface MapFrame {
  readonly width: number;
  readonly height: number;
  readonly pxPerM: number;
  at(point: Metres): readonly [x: number, y: number];
}

const EARTH_RADIUS_M = 6_371_008.8;
const RADIANS = Math.PI / 180;
const MARGIN_PX = 22;
/** A vessel close by is not blown up to fill the map. */
const LEAST_EXTENT_M = 60;

/** East and north of `from` on a plane: good to a metre over the ten kilometres a camera sees. */
export function metresFrom(
  from: { readonly lat_deg: number; readonly lon_deg: number },
  latDeg: number,
  lonDeg: number,
): Metres {
  const across = Math.cos(((from.lat_deg + latDeg) / 2) * RADIANS);
  const turn = ((lonDeg - from.lon_deg + 540) % 360) - 180;
  return [
    turn * RADIANS * EARTH_RADIUS_M * across,
    (latDeg - from.lat_deg) * RADIANS * EARTH_RADIUS_M,
  ];
}

/** The frame that shows all these points. */
export function frameOf(points: readonly Metres[], width: number, height: number): MapFrame {
  const easts = points.map(([east]) => east);
  const norths = points.map(([, north]) => north);
  const [west, east] = [Math.min(...easts), Math.max(...easts)];
  const [south, north] = [Math.min(...norths), Math.max(...norths)];
  const pxPerM = Math.min(
    (width - 2 * MARGIN_PX) / Math.max(LEAST_EXTENT_M, east - west),
    (height - 2 * MARGIN_PX) / Math.max(LEAST_EXTENT_M, north - south),
  );
  const [middleEast, middleNorth] = [(west + east) / 2, (south + north) / 2];
  return {
    width,
    height,
    pxPerM,
    at: ([x, y]) => [width / 2 + (x - middleEast) * pxPerM, height / 2 - (y - middleNorth) * pxPerM],
  };
}

/** The longest round length (1, 2 or 5 times a power of ten) not longer than this many metres. */
export function roundLengthM(mostM: number): number {
  const power = 10 ** Math.floor(Math.log10(mostM));
  const digit = [5, 2, 1].find((candidate) => candidate * power <= mostM) ?? 1;
  return digit * power;
}
