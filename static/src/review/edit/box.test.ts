import { readFileSync } from "node:fs";

import { describe, expect, it } from "vitest";

import { onWater } from "../../geometry/camera";
import type { Point } from "../../viewer/view";
import {
  bearingsFrom,
  changeBetween,
  cornersOf,
  flipped,
  movedAlong,
  projectBox,
  resized,
  stretched,
  turnBetween,
  type LocalBox,
} from "./box";
import { dragged, HANDLES, handlePixel, handlePoint } from "./drag";
import { cameraOf, type EditCamera } from "./edit-view";
import { stepped } from "./steps";

interface GoldenCase {
  readonly name: string;
  readonly camera: EditCamera;
  readonly box: LocalBox;
  readonly corners_in_image_px: readonly (readonly [number, number] | null)[];
}

const { cases } = JSON.parse(
  readFileSync(new URL("../../../../tests/golden/pose_projection.json", import.meta.url), "utf8"),
) as { cases: readonly GoldenCase[] };
const [tug] = cases;
if (tug === undefined) {
  throw new Error("The golden file is empty.");
}
const CAMERA = cameraOf(tug.camera);
const TUG = tug.box;
const BEARINGS = bearingsFrom(CAMERA);

describe("the browser's projection", () => {
  it.each(cases)("puts $name where the server puts it, to a tenth of a pixel", (golden) => {
    const corners = projectBox(cameraOf(golden.camera), golden.box);
    golden.corners_in_image_px.forEach((expected, i) => {
      const [u, v] = corners[i] ?? [Infinity, Infinity];
      if (expected === null) {
        expect(u).toBeNaN();
      } else {
        expect(Math.hypot(u - expected[0], v - expected[1])).toBeLessThan(0.1);
      }
    });
  });
});

describe("steps", () => {
  it("move on the water as the camera sees it: a key to the right leads to the right", () => {
    const right = movedAlong(TUG, BEARINGS, 5, 0);
    const farther = movedAlong(TUG, BEARINGS, 0, 5);
    const pixel = (box: LocalBox): Point => handlePixel(CAMERA, box, "move") ?? [0, 0];
    expect(pixel(right)[0]).toBeGreaterThan(pixel(TUG)[0] + 10);
    expect(pixel(farther)[1]).toBeLessThan(pixel(TUG)[1] - 1);
    expect(right.up_m).toBe(TUG.up_m);
    const change = changeBetween(TUG, movedAlong(TUG, BEARINGS, 5, -3), BEARINGS);
    expect(change.across_m).toBeCloseTo(5, 12);
    expect(change.away_m).toBeCloseTo(-3, 12);
  });

  it("are a metre or a degree, and a tenth of it when fine", () => {
    const wider = stepped("edit.wider", { fine: true }, TUG, BEARINGS);
    expect(wider?.width_m).toBeCloseTo(7.1, 12);
    const turned = stepped("edit.turn-left", { fine: false }, TUG, BEARINGS);
    expect(turned?.heading_deg).toBeCloseTo(111, 12);
    expect(stepped("edit.save", { fine: false }, TUG, BEARINGS)).toBeNull();
  });

  it("turn past north without a jump, and say the shorter way", () => {
    expect(flipped({ ...TUG, heading_deg: 270 }).heading_deg).toBe(90);
    expect(turnBetween(359, 2)).toBe(3);
    expect(turnBetween(10, 350)).toBe(-20);
    expect(turnBetween(0, 180)).toBe(180);
  });

  it("never make a size that is none", () => {
    expect(resized(TUG, "height_m", -3).height_m).toBe(0.5);
    expect(resized(TUG, "width_m", 1e6).width_m).toBe(120);
  });

  it("leave the opposite face where it is when one face is moved", () => {
    const longer = stretched(TUG, "length_m", 1, 25);
    const [before, after] = [cornersOf(TUG)[2], cornersOf(longer)[2]];
    expect(after?.[0]).toBeCloseTo(before?.[0] ?? 0, 9);
    expect(after?.[1]).toBeCloseTo(before?.[1] ?? 0, 9);
    expect(longer.length_m).toBe(25);
  });
});

describe("dragging", () => {
  it.each(HANDLES)("the handle %s follows the pointer along its own way", (handle) => {
    const from = handlePixel(CAMERA, TUG, handle) ?? [0, 0];
    const target = handleTarget(handle);
    const to = handlePixel(CAMERA, target, handle) ?? [0, 0];
    const box = dragged(CAMERA, TUG, handle, from, to);
    const at = handlePixel(CAMERA, box, handle) ?? [0, 0];
    expect(Math.hypot(at[0] - to[0], at[1] - to[1])).toBeLessThan(0.01);
    for (const key of ["heading_deg", "length_m", "width_m", "height_m"] as const) {
      expect(box[key]).toBeCloseTo(target[key], 4);
    }
  });

  it("keeps the grip where it was taken, not its middle", () => {
    const grip: Point = [1200, 900];
    const water = onWater(CAMERA, grip, TUG.up_m);
    const box = dragged(CAMERA, TUG, "move", grip, grip);
    expect(water).not.toBeNull();
    expect(box.east_m).toBeCloseTo(TUG.east_m, 9);
    expect(box.north_m).toBeCloseTo(TUG.north_m, 9);
  });

  it("leaves the box alone where the pointer is above the horizon", () => {
    const from = handlePixel(CAMERA, TUG, "move") ?? [0, 0];
    expect(dragged(CAMERA, TUG, "move", from, [from[0], -4000])).toBe(TUG);
  });

  it("sits on the box: the turn handle before the bow, the top handle on the roof", () => {
    expect(handlePoint(TUG, "top")[2]).toBeCloseTo(TUG.height_m, 12);
    const [east, north] = handlePoint(TUG, "turn");
    expect(Math.hypot(east, north)).toBeGreaterThan(TUG.length_m / 2);
  });
});

function handleTarget(handle: (typeof HANDLES)[number]): LocalBox {
  switch (handle) {
    case "move":
      return movedAlong(TUG, BEARINGS, 4, 6);
    case "turn":
      return { ...TUG, heading_deg: 127 };
    case "bow":
      return stretched(TUG, "length_m", 1, 24);
    case "stern":
      return stretched(TUG, "length_m", -1, 16);
    case "port":
      return stretched(TUG, "width_m", 1, 9);
    case "starboard":
      return stretched(TUG, "width_m", -1, 5);
    case "top":
      return resized(TUG, "height_m", 11);
  }
}
