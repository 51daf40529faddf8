import { describe, expect, it } from "vitest";

import {
  cornerOf,
  CORNERS,
  grownRect,
  isLargeEnough,
  movedRect,
  oppositeOf,
  rectBetween,
} from "./missed-box";

const IMAGE = { width: 640, height: 480 };
const RECT = { x1: 100, y1: 50, x2: 200, y2: 90 };

describe("the box around a missed vessel", () => {
  it("is the same whichever corner the drag began at, and stays in the image", () => {
    expect(rectBetween([200, 90], [100, 50], IMAGE)).toEqual(RECT);
    expect(rectBetween([600, -30], [900, 10], IMAGE)).toEqual({ x1: 600, y1: -0.5, x2: 639.5, y2: 10 });
  });

  it("is none while it is only a click", () => {
    expect(isLargeEnough(RECT)).toBe(true);
    expect(isLargeEnough(rectBetween([5, 5], [7, 40], IMAGE))).toBe(false);
  });

  it("keeps its size when it is moved against the border", () => {
    expect(movedRect(RECT, -500, 0, IMAGE)).toEqual({ x1: -0.5, y1: 50, x2: 99.5, y2: 90 });
    expect(movedRect(RECT, 7, 3, IMAGE)).toEqual({ x1: 107, y1: 53, x2: 207, y2: 93 });
  });

  it("grows about its middle and never turns inside out", () => {
    expect(grownRect(RECT, 10, -4, IMAGE)).toEqual({ x1: 95, y1: 52, x2: 205, y2: 88 });
    expect(isLargeEnough(grownRect(RECT, -1e4, -1e4, IMAGE))).toBe(true);
  });

  it("is stretched by a corner against the opposite one", () => {
    for (const corner of CORNERS) {
      const rect = rectBetween(cornerOf(RECT, corner), cornerOf(RECT, oppositeOf(corner)), IMAGE);
      expect(rect).toEqual(RECT);
    }
  });
});
