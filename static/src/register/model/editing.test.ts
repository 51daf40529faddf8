import { describe, expect, it } from "vitest";
import { EnuFrame } from "../../geometry/geodesy";
import { DraftBox, type Store } from "./draft";
import { History } from "./history";
import { describeChange, merge } from "./merge";
import { nextWorst, sorted, WORST_FIRST, type Errors } from "./order";
import { checkPlace } from "./place-entry";
import { freeName, type Point } from "./point";

const FRAME = new EnuFrame({ latDeg: 53.54, lonDeg: 9.98, heightM: 40 });

function point(key: string, changes: Partial<Point> = {}): Point {
  return {
    key,
    landmarkId: 1,
    name: key,
    place: { latDeg: 53.54, lonDeg: 9.98, heightM: 45 },
    pixel: [100, 200],
    role: "control",
    ...changes,
  };
}

describe("History", () => {
  it("undoes and redoes every edit, a drag as one", () => {
    const history = new History(0);
    history.edit(1, "add");
    history.edit(2, "drag", "stroke-1");
    history.edit(3, "drag", "stroke-1");
    expect(history.undoLabel).toBe("drag");
    history.undo();
    expect(history.state).toBe(1);
    history.redo();
    expect(history.state).toBe(3);
    history.undo();
    history.undo();
    expect(history.state).toBe(0);
    expect(history.undo()).toBe(false);
    history.edit(9, "other");
    expect(history.redo()).toBe(false);
  });

  it("tells past and future of what a save made known", () => {
    const history = new History("a");
    history.edit("b", "edit");
    history.amend((state) => `${state}!`);
    expect(history.state).toBe("b!");
    history.undo();
    expect(history.state).toBe("a!");
  });
});

describe("checkPlace", () => {
  const typed = { lat: "53.541", lon: "9.981", height: "2.5", datum: "water" } as const;

  it("counts a height above the water from the site's water level", () => {
    expect(checkPlace(typed, FRAME, 39.6)).toEqual({
      place: { latDeg: 53.541, lonDeg: 9.981, heightM: 42.1 },
    });
  });

  it("takes a pair typed into the first field", () => {
    expect(checkPlace({ ...typed, lat: "53.541, 9.981", lon: "" }, FRAME, 0).errors).toBeUndefined();
  });

  it("names exchanged coordinates and places far away", () => {
    const exchanged = checkPlace({ ...typed, lat: "9.981", lon: "53.541" }, FRAME, 0);
    expect(exchanged.errors).toMatchObject({ isExchanged: true });
    expect(checkPlace({ ...typed, lat: "43.541" }, FRAME, 0).errors?.lat).toContain("km from the site");
  });

  it("says of each field what is wrong with it", () => {
    const { errors } = checkPlace({ lat: "53 75", lon: "x", height: "", datum: "water" }, FRAME, 0);
    expect(errors?.lat).toContain("75 minutes");
    expect(errors?.lon).toContain("is no coordinate");
    expect(errors?.height).toContain("Give the height");
  });
});

describe("order", () => {
  const points = [point("a"), point("b"), point("c", { pixel: null }), point("d", { role: "check" })];
  const errors = new Map<string, Errors>([
    ["a", { errorPx: 1, leaveOneOutPx: 2 }],
    ["b", { errorPx: 2, leaveOneOutPx: 9 }],
    ["d", { errorPx: 4, leaveOneOutPx: null }],
  ]);

  it("puts what waits first, then the worst", () => {
    expect(sorted(points, errors, WORST_FIRST).map(({ key }) => key)).toEqual(["c", "b", "d", "a"]);
    const byName = sorted(points, errors, { column: "name", descending: false });
    expect(byName.map(({ key }) => key)).toEqual(["c", "a", "b", "d"]);
  });

  it("goes from worst to next worst and around", () => {
    expect(nextWorst(points, errors, null)?.key).toBe("c");
    expect(nextWorst(points, errors, "b")?.key).toBe("d");
    expect(nextWorst(points, errors, "a")?.key).toBe("c");
    expect(nextWorst([], errors, null)).toBeNull();
  });
});

describe("merge", () => {
  const base = [point("a"), point("b"), point("c")];

  it("takes what one side changed and asks where both did", () => {
    const mine = [point("a", { pixel: [1, 1] }), point("b", { role: "off" }), point("c"), point("new")];
    const theirs = [point("a", { pixel: [2, 2] }), point("b"), point("theirs")];
    const merged = merge(base, mine, theirs);
    expect(merged.conflicts.map(({ key }) => key)).toEqual(["a"]);
    expect(merged.taken.map(({ before, after }) => (after ?? before)?.key).sort()).toEqual(["c", "theirs"]);
    const resolved = merged.resolve(new Map([["a", "theirs"]]));
    expect(resolved.map(({ key }) => key).sort()).toEqual(["a", "b", "new", "theirs"]);
    expect(resolved.find(({ key }) => key === "a")?.pixel).toEqual([2, 2]);
    expect(resolved.find(({ key }) => key === "b")?.role).toBe("off");
  });

  it("sees no conflict where both did the same", () => {
    const same = [point("a", { pixel: [5, 5] }), point("b"), point("c")];
    expect(merge(base, same, same).conflicts).toEqual([]);
  });

  it("says what changed", () => {
    expect(describeChange(point("a"), point("a", { pixel: [101.26, 200] }))).toBe(
      "pixel (100.0, 200.0) → (101.3, 200.0)",
    );
    expect(describeChange(point("a"), null)).toBe("removed");
  });
});

describe("DraftBox", () => {
  it("keeps a draft and survives a store that refuses", () => {
    const kept = new Map<string, string>();
    const store: Store = {
      getItem: (key) => kept.get(key) ?? null,
      setItem: (key, value) => void kept.set(key, value),
      removeItem: (key) => void kept.delete(key),
    };
    const box = new DraftBox(store, "a@b", 3);
    expect(box.write({ version: 2, base: [], points: [point("a")], savedAt: "" })).toBe(true);
    expect(new DraftBox(store, "a@b", 3).read()?.points).toEqual([point("a")]);
    expect(new DraftBox(store, "other", 3).read()).toBeNull();
    box.clear();
    expect(box.read()).toBeNull();
    const refusing = new DraftBox({ ...store, setItem: () => { throw new Error("full"); } }, "a@b", 3);
    expect(refusing.write({ version: 1, base: [], points: [], savedAt: "" })).toBe(false);
  });
});

it("freeName gives the first number that is free", () => {
  expect(freeName(["Point 1", "Point 3", "Crane"])).toBe("Point 2");
});
