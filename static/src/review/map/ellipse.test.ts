import { describe, expect, it } from "vitest";

import { ellipseOf, outlineOf, type Ellipse } from "./ellipse";

const of = (east: number, both: number, north: number): Ellipse | null =>
  ellipseOf({
    position_covariance_in_enu_m2: [
      [east, both, 0],
      [both, north, 0],
      [0, 0, 1],
    ],
  });

describe("the ellipse of a place", () => {
  it("has its longer axis where the place is least known", () => {
    expect(of(1, 0, 9)).toEqual({ longM: 3, shortM: 1, bearingDeg: 0 });
    expect(of(9, 0, 1)).toEqual({ longM: 3, shortM: 1, bearingDeg: 90 });
    expect(of(5, 4, 5)?.bearingDeg).toBeCloseTo(45, 9);
    expect(of(5, -4, 5)?.bearingDeg).toBeCloseTo(135, 9);
    expect(of(5, 4, 5)?.longM).toBeCloseTo(3, 9);
  });

  it("is drawn around the place", () => {
    const ellipse = of(9, 0, 1);
    const [first] = ellipse === null ? [] : outlineOf(ellipse, [100, 50], 2);
    expect(first?.[0]).toBeCloseTo(106, 9);
    expect(first?.[1]).toBeCloseTo(50, 9);
  });

  it("is none where nobody says how sure the place is", () => {
    expect(ellipseOf({ position_covariance_in_enu_m2: null })).toBeNull();
  });
});
