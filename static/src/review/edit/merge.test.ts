import { describe, expect, it } from "vitest";

import type { Bearings, LocalBox } from "./box";
import { Drafts } from "./draft";
import { differences, merged } from "./merge";

const LOOKING_NORTH: Bearings = { across: [1, 0], away: [0, 1] };
const GENERATED: LocalBox = {
  east_m: 0,
  north_m: 0,
  up_m: 0,
  heading_deg: 112,
  length_m: 19,
  width_m: 7,
  height_m: 7.6,
};
const MINE = { ...GENERATED, east_m: 2, north_m: -1, heading_deg: 100 };
const THEIRS = { ...GENERATED, heading_deg: 95, width_m: 8 };

describe("merging two people's corrections", () => {
  it("asks only for what differs, in words that can be compared", () => {
    expect(differences(GENERATED, MINE, THEIRS, LOOKING_NORTH)).toEqual([
      {
        part: "place",
        name: "Place",
        mine: "2.0 m right, 1.0 m nearer",
        theirs: "0.0 m right, 0.0 m farther",
      },
      { part: "heading_deg", name: "Heading", mine: "100.0°", theirs: "95.0°" },
      { part: "width_m", name: "Width", mine: "7.0 m", theirs: "8.0 m" },
    ]);
    expect(differences(GENERATED, MINE, MINE, LOOKING_NORTH)).toEqual([]);
  });

  it("takes each part from the side that was chosen, mine where nobody chose", () => {
    const box = merged(MINE, THEIRS, new Map([["width_m", "theirs"]]));
    expect(box).toEqual({ ...MINE, width_m: 8 });
    expect(merged(MINE, THEIRS, new Map([["place", "theirs"]])).east_m).toBe(0);
  });
});

describe("changes not saved yet", () => {
  it("come back for the same person only, and are gone once saved", () => {
    const kept = new Map<string, string>();
    const store = {
      getItem: (name: string) => kept.get(name) ?? null,
      setItem: (name: string, value: string) => void kept.set(name, value),
      removeItem: (name: string) => void kept.delete(name),
    };
    const drafts = new Drafts(store, "ada@example.org");
    const { key } = drafts.write(7, MINE, 3);
    expect(new Drafts(store, "ada@example.org").read(7)).toEqual({ box: MINE, version: 3, key });
    expect(new Drafts(store, "bob@example.org").read(7)).toBeNull();
    drafts.forget(7);
    expect(drafts.read(7)).toBeNull();
    kept.set("quaymark.edit.ada@example.org.8", "{broken");
    expect(drafts.read(8)).toBeNull();
  });
});
