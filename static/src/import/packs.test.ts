import { describe, expect, it } from "vitest";
import { Pace, told } from "./pace";
import { PACK_BYTES, type Sendable, isInPieces, packed } from "./packs";

const file = (id: number, size: number, isArchive = false): Sendable => ({ id, size, isArchive });

describe("packs of files", () => {
  it("keeps small files together up to the limit, in order, and loses none", () => {
    const files = Array.from({ length: 500 }, (_, id) => file(id, 100_000));
    const packs = packed(files);
    expect(packs.flat().map(({ id }) => id)).toEqual(files.map(({ id }) => id));
    for (const pack of packs) {
      expect(pack.reduce((sum, { size }) => sum + size, 0)).toBeLessThanOrEqual(PACK_BYTES);
    }
  });

  it("sends what is large, and every archive, alone and in pieces", () => {
    const packs = packed([file(1, 10), file(2, PACK_BYTES + 1), file(3, 10, true), file(4, 10)]);
    expect(packs.map((pack) => pack.map(({ id }) => id))).toEqual([[2], [3], [1, 4]]);
    expect(packs.map(isInPieces)).toEqual([true, true, false]);
  });
});

describe("the pace of sending", () => {
  it("goes by the last seconds, so that a pause does not weigh for ever", () => {
    const pace = new Pace();
    expect(pace.rate()).toBeNull();
    for (let second = 0; second <= 60; second += 1) {
      pace.note(second * 1000, second < 30 ? 0 : (second - 30) * 2e6);
    }
    expect(pace.rate()).toBeCloseTo(2e6);
    expect(told(2e6, 60e6)).toBe("2.0 MB/s, 30 s left");
  });
});
