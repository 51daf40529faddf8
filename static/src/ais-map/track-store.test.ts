import { describe, expect, it } from "vitest";
import { TrackStore, type MovedJson, type StretchJson } from "./track-store";

const START = "2026-06-01T10:00:00Z";
const BASE = Date.parse(START) / 1000;

function moved(mmsi: number, t: readonly number[]): MovedJson {
  const flat = t.map(() => 0);
  const about = { name: null, ship_type: null, ais_class: "A", length_m: null, width_m: null, flags: [] };
  return { mmsi, ...about, t, lat: flat, lon: flat, sog: flat, cog: flat, heading: flat };
}

function stretch(...vessels: readonly MovedJson[]): StretchJson {
  return { start: START, longest_silence_s: 600, vessels };
}

function times(store: TrackStore, id: string): number[] {
  return (store.find(id)?.t ?? []).map((seconds) => seconds - BASE);
}

describe("what comes live", () => {
  it("is put in by its time, once, and is there however chunks are loaded after it", () => {
    const store = new TrackStore();
    store.add(BASE / 600, stretch(moved(1, [0, 10])));
    store.append(stretch(moved(1, [10, 20, 10]), moved(2, [15])), 600); // steps: 10, 30, 40
    store.append(stretch(moved(1, [20]), moved(1, [30])), 600);
    expect(times(store, "1")).toEqual([0, 10, 20, 30, 40]);
    expect(times(store, "2")).toEqual([15]);
    store.add(BASE / 600, stretch(moved(1, [0, 10, 10]))); // asked for before the news came
    expect(times(store, "1")).toEqual([0, 10, 20, 30, 40]);
    store.append(stretch(moved(1, [605])), 600);
    store.add(BASE / 600 + 1, stretch(moved(3, [700])));
    expect(times(store, "1")).toEqual([0, 10, 20, 30, 40, 605]);
    expect(store.tracks.length).toBe(3);
  });
});
