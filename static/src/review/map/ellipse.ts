/** How sure a pose's place is: the ellipse of one standard deviation on the water. */
import type { Metres } from "./map-frame";

export interface Ellipse {
  readonly longM: number;
  readonly shortM: number;
  /** Of the longer axis, clockwise from north, 0 to 180. */
  readonly bearingDeg: number;
}

interface Placed {
  readonly position_covariance_in_enu_m2: readonly (readonly number[])[] | null;
}

const POINTS = 48;

export function ellipseOf({ position_covariance_in_enu_m2: covariance }: Placed): Ellipse | null {
  if (covariance === null) {
    return null;
  }
  const [[east = 0, both = 0] = [], [, north = 0] = []] = covariance;
  const [mean, half] = [(east + north) / 2, Math.hypot((east - north) / 2, both)];
  const bearing = (Math.atan2(both, (north - east) / 2) / 2) * (180 / Math.PI);
  return {
    longM: Math.sqrt(Math.max(0, mean + half)),
    shortM: Math.sqrt(Math.max(0, mean - half)),
    bearingDeg: (bearing + 180) % 180,
  };
}

/** Its outline around a place, `scale` standard deviations out. */
export function outlineOf(ellipse: Ellipse, at: Metres, scale: number): readonly Metres[] {
  const bearing = ellipse.bearingDeg * (Math.PI / 180);
  const [s, c] = [Math.sin(bearing), Math.cos(bearing)];
  return Array.from({ length: POINTS }, (_, i) => {
    const angle = (2 * Math.PI * i) / POINTS;
    const along = scale * ellipse.longM * Math.cos(angle);
    const across = scale * ellipse.shortM * Math.sin(angle);
    return [at[0] + along * s + across * c, at[1] + along * c - across * s] as const;
  });
}
