import { describe, expect, it } from "vitest";
import { placeLabels } from "./labels";

describe("placeLabels", () => {
  it("goes to the left where the right is taken, and is silent where both are", () => {
    const row = [0, 60, 120].map((x) => ({ x: 200 + x, y: 50, width: 30 }));
    expect(placeLabels(row, 1000)).toEqual(["right", "right", "right"]);
    const tight = [0, 40].map((x) => ({ x: 200 + x, y: 50, width: 60 }));
    expect(placeLabels(tight, 1000)).toEqual(["left", "right"]);
    const crowd = [0, 30, 60].map((x) => ({ x: 200 + x, y: 50, width: 60 }));
    expect(placeLabels(crowd, 1000)).toEqual(["left", null, "right"]);
  });

  it("writes over minor marks, but not the other way round", () => {
    const major = { x: 200, y: 50, width: 60 };
    const minor = { x: 262, y: 50, width: 60, isMinor: true };
    expect(placeLabels([major, minor], 1000)).toEqual(["right", "right"]);
    expect(placeLabels([minor, { ...major, x: 290 }], 1000)).toEqual(["left", "right"]);
  });

  it("stays on the screen", () => {
    expect(placeLabels([{ x: 380, y: 50, width: 60 }], 400)).toEqual(["left"]);
  });
});
