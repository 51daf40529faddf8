import { describe, expect, it } from "vitest";

import { spread } from "./spread";

describe("handles on the screen", () => {
  it("stand off the box, outward from its middle", () => {
    const places = spread([{ name: "top", at: [100, 50] }], [100, 100], 20, 40);
    expect(places.get("top")).toEqual([100, 30]);
  });

  it("never come closer together than a finger needs, even on a box of a few pixels", () => {
    const names = ["a", "b", "c", "d", "e", "f", "g"] as const;
    const anchors = names.map((name, i) => ({ name, at: [100 + (i % 3), 100 + (i % 2)] as const }));
    const places = [...spread(anchors, [101, 100.5], 20, 40).values()];
    for (const [i, a] of places.entries()) {
      for (const b of places.slice(i + 1)) {
        expect(Math.hypot(a[0] - b[0], a[1] - b[1])).toBeGreaterThan(36);
      }
    }
  });
});
