import { describe, expect, it } from "vitest";

import { cameraFrom } from "./camera";
import { horizonOf } from "./horizon";

const LENS = {
  widthPx: 2560,
  heightPx: 1920,
  fxPx: 6570,
  fyPx: 6570,
  cxPx: 1279.5,
  cyPx: 959.5,
  distortion: [0, 0, 0, 0, 0] as const,
};
/** Level, looking north. */
const LEVEL = cameraFrom(LENS, [Math.PI / 2, 0, 0], [0, 0, 30]);

describe("horizon", () => {
  it("lies below the level by the dip: 0.176 degrees from 30 m", () => {
    const [line] = horizonOf(LEVEL, 30);
    const middle = line?.find(([u]) => Math.abs(u - 1279.5) < 40);
    expect(middle?.[1]).toBeCloseTo(959.5 + 6570 * Math.tan(0.1758 * (Math.PI / 180)), 0);
  });

  it("crosses the whole image", () => {
    const [line] = horizonOf(LEVEL, 30);
    expect(Math.min(...(line ?? []).map(([u]) => u))).toBeLessThan(0);
    expect(Math.max(...(line ?? []).map(([u]) => u))).toBeGreaterThan(2560);
  });

  it("is nowhere for a camera below the water or one that looks down", () => {
    expect(horizonOf(LEVEL, -1)).toEqual([]);
    expect(horizonOf(cameraFrom(LENS, [Math.PI, 0, 0], [0, 0, 30]), 30)).toEqual([]);
  });
});
