import { describe, expect, it } from "vitest";
import { EnuFrame, ecefFromGeodetic, geodeticFromEcef } from "./geodesy";

const PYPROJ = [3741061.4221524, 658303.6699602, 5106518.9287408] as const;

describe("geodesy", () => {
  it("gives the geocentric coordinates that pyproj gives", () => {
    // pyproj, EPSG:4979 to EPSG:4978.
    const [x, y, z] = ecefFromGeodetic({ latDeg: 53.54, lonDeg: 9.98, heightM: 43.1 });
    expect(x).toBeCloseTo(PYPROJ[0], 6);
    expect(y).toBeCloseTo(PYPROJ[1], 6);
    expect(z).toBeCloseTo(PYPROJ[2], 6);
  });

  it("comes back from metres to the same degrees, also at poles and the date line", () => {
    for (const latDeg of [-90, -53.5, 0, 12.3, 89.999]) {
      for (const lonDeg of [-179.99, -9.98, 0, 120]) {
        const back = geodeticFromEcef(ecefFromGeodetic({ latDeg, lonDeg, heightM: 812.5 }));
        expect(back.latDeg).toBeCloseTo(latDeg, 10);
        expect(back.heightM).toBeCloseTo(812.5, 6);
        if (Math.abs(latDeg) < 90) {
          expect(back.lonDeg).toBeCloseTo(lonDeg, 10);
        }
      }
    }
  });

  it("places points of the local frame and finds them again", () => {
    const frame = new EnuFrame({ latDeg: 53.54, lonDeg: 9.98, heightM: 40 });
    const place = frame.geodetic([1200, -340, 12]);
    const [east, north, up] = frame.position(place);
    expect(east).toBeCloseTo(1200, 7);
    expect(north).toBeCloseTo(-340, 7);
    expect(up).toBeCloseTo(12, 7);
  });

  it("lets the water fall away with the earth's curvature", () => {
    const frame = new EnuFrame({ latDeg: 53.54, lonDeg: 9.98, heightM: 40 });
    // 2 km away the surface lies d^2 / 2R = 0.313 m below the tangent plane.
    expect(frame.onLevel(2000, 0, 40)[2]).toBeCloseTo(-0.313, 2);
  });
});
