import { describe, expect, it } from "vitest";
import { drawn, extent, poseAt, vesselName } from "./pose";
import { aPose } from "./pose.fixture";

const SMALL = { x1_px: 1300, y1_px: 850, x2_px: 1340, y2_px: 870, score: 0.5, id: 1 };
const OUT_OF_SIGHT = Array.from({ length: 8 }, () => null);

describe("a pose in the image", () => {
  it("extends over detection and projected box together", () => {
    expect(extent(aPose({ id: 1, imageId: 1 }))).toEqual({ x1: 1178, y1: 790, x2: 1507, y2: 955 });
  });

  it("extends over the detection alone where the box cannot be projected", () => {
    const pose = aPose({ id: 1, imageId: 1, detection: SMALL, corners: OUT_OF_SIGHT });
    expect(extent(pose)).toEqual({ x1: 1300, y1: 850, x2: 1340, y2: 870 });
    expect(drawn(pose).corners[0]).toEqual([Number.NaN, Number.NaN]);
  });

  it("is picked by a point inside it, the smallest where several lie there", () => {
    const large = aPose({ id: 1, imageId: 1 });
    const small = aPose({ id: 2, imageId: 1, detection: SMALL, corners: OUT_OF_SIGHT });
    expect(poseAt([large, small], [1320, 860])?.id).toBe(2);
    expect(poseAt([large, small], [1200, 860])?.id).toBe(1);
    expect(poseAt([large, small], [10, 10])).toBeNull();
  });

  it("is called by its MMSI where the vessel has no name", () => {
    const pose = aPose({ id: 1, imageId: 1 });
    expect(vesselName(pose)).toBe("MMSI 211111111");
    expect(vesselName({ ...pose, vessel: { ...pose.vessel, name: " TUG 7 " } })).toBe("TUG 7");
  });
});
