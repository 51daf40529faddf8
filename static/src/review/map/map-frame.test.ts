import { describe, expect, it } from "vitest";

import { frameOf, metresFrom, roundLengthM } from "./map-frame";

const CAMERA = { lat_deg: 53.54, lon_deg: 9.98 };

describe("the small map", () => {
  it("measures metres from the camera, also across the date line", () => {
    const [east, north] = metresFrom(CAMERA, 53.541, 9.98);
    expect(east).toBeCloseTo(0, 9);
    expect(north).toBeCloseTo(111.2, 1);
    expect(metresFrom({ lat_deg: 0, lon_deg: 179.999 }, 0, -179.999)[0]).toBeCloseTo(222.4, 1);
  });

  it("keeps everything in sight, north up", () => {
    const frame = frameOf([[0, 0], [-300, 200], [40, 900]], 300, 180);
    for (const point of [[0, 0], [-300, 200], [40, 900]] as const) {
      const [x, y] = frame.at(point);
      expect(x).toBeGreaterThanOrEqual(20);
      expect(x).toBeLessThanOrEqual(280);
      expect(y).toBeGreaterThanOrEqual(20);
      expect(y).toBeLessThanOrEqual(160);
    }
    expect(frame.at([0, 900])[1]).toBeLessThan(frame.at([0, 0])[1]);
  });

  it("shows a single place without dividing by nothing", () => {
    expect(frameOf([[5, 5]], 300, 180).at([5, 5])).toEqual([150, 90]);
  });

  it("has a scale bar of a round length", () => {
    expect([999, 499, 250, 180, 10].map(roundLengthM)).toEqual([500, 200, 200, 100, 10]);
  });
});
