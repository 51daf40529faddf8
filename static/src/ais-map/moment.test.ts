import { describe, expect, it } from "vitest";

import { atMoment, lastBefore } from "./moment";
import { latOf, lonOf, TrackStore, worldX, worldY, type StretchJson } from "./track-store";

const MOVED = {
  mmsi: 211234560,
  name: "ANNEGRET",
  ship_type: null,
  ais_class: "A",
  length_m: null,
  width_m: null,
  flags: [],
  t: [0, 100, 900],
  lat: [5_350_000, 100, 0],
  lon: [1_000_000, 0, 0],
  sog: [52, -1, 0],
  cog: [350, 10, 90],
  heading: [350, 10, -1],
};

function stored(...stretches: readonly StretchJson[]): TrackStore {
  const store = new TrackStore();
  stretches.forEach((stretch, index) => {
    store.add(index, stretch);
  });
  return store;
}

const STRETCH: StretchJson = { start: "2026-01-01T00:00:00Z", longest_silence_s: 600, vessels: [MOVED] };
const START_S = Date.parse(STRETCH.start) / 1000;

describe("a vessel at a moment", () => {
  const [track] = stored(STRETCH).tracks;
  const at = (seconds: number): ReturnType<typeof atMoment> =>
    track === undefined ? null : atMoment(track, START_S + seconds, 600);

  it("is between its reports, its bow turned the short way round", () => {
    const found = at(50);
    expect(latOf(found?.y ?? 0)).toBeCloseTo(53.5005, 6);
    expect(lonOf(found?.x ?? 0)).toBeCloseTo(10, 9);
    expect(found?.headingDeg).toBeCloseTo(0, 6);
    expect(found).toMatchObject({ sogKn: 5.2, silentS: 0 });
  });

  it("stays where it was last heard, and vanishes in a gap", () => {
    expect(at(400)).toMatchObject({ silentS: 300, headingDeg: 10, sogKn: null });
    expect(at(701)).toBeNull();
    expect(at(-1)).toBeNull();
  });

  it("has no heading from its course while it lies still", () => {
    expect(at(1000)?.headingDeg).toBeNull();
  });
});

describe("chunks of tracks", () => {
  it("join to one track whatever comes first", () => {
    const store = new TrackStore();
    store.add(2, { ...STRETCH, start: "2026-01-01T01:00:00Z" });
    store.add(0, { ...STRETCH, vessels: [{ ...MOVED, flags: ["jump"] }] });
    expect(store.tracks).toHaveLength(1);
    expect(store.tracks[0]?.t.map((time) => time - START_S)).toEqual([0, 100, 1000, 3600, 3700, 4600]);
    expect([...(store.tracks[0]?.flags ?? [])]).toEqual(["jump"]);
  });
});

describe("searching times", () => {
  it("finds the last one that is not later", () => {
    expect([0, 5, 7, 20].map((wanted) => lastBefore([5, 5, 10], wanted))).toEqual([-1, 1, 1, 2]);
  });

  it("keeps places through the map's coordinates", () => {
    expect(latOf(worldY(-33.5))).toBeCloseTo(-33.5, 9);
    expect(lonOf(worldX(179.5))).toBeCloseTo(179.5, 9);
  });
});
