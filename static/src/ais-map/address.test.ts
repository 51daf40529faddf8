import { describe, expect, it } from "vitest";

import { readAddress, writeAddress } from "./address";
import { CHUNK_S, chunksFor, covers } from "./chunks";

describe("the map's address", () => {
  it("shows the same again", () => {
    const state = {
      momentS: Date.parse("2026-01-02T03:04:05Z") / 1000,
      windowS: 3600,
      box: [9.9, 53.5, 10.1, 53.6] as const,
      vessel: "V-7KQ2MB5RXA3D",
      isLive: false,
    };
    expect(readAddress(writeAddress(state))).toEqual(state);
    const live = { ...state, momentS: null, isLive: true };
    expect(readAddress(writeAddress({ ...live, momentS: state.momentS }))).toEqual(live);
  });

  it("passes over what is no moment, window or box", () => {
    expect(readAddress("?t=soon&window=-5&bbox=1,2,3")).toEqual({
      momentS: null,
      windowS: 1800,
      box: null,
      vessel: null,
      isLive: false,
    });
  });
});

describe("what is loaded", () => {
  it("begins with the moment itself", () => {
    expect(chunksFor(10 * CHUNK_S + 5, 2 * CHUNK_S, 300)).toEqual([10, 9, 8]);
    expect(chunksFor(10 * CHUNK_S + 500, 60, 300)).toEqual([10, 11]);
  });

  it("serves nearby views at nearly the same scale only", () => {
    const loaded = { box: [0, 0, 4, 4], toleranceM: 8 } as const;
    expect(covers(loaded, { box: [1, 1, 3, 3], toleranceM: 4 })).toBe(true);
    expect(covers(loaded, { box: [1, 1, 3, 3], toleranceM: 2 })).toBe(false);
    expect(covers(loaded, { box: [1, 1, 5, 3], toleranceM: 8 })).toBe(false);
  });
});
