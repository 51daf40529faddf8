/** The browser's solver and the server's give the same figures: files that both are tested with. */
import { readdirSync, readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import type { Camera, Intrinsics, Pixel } from "./camera";
import type { Distortion } from "./distortion";
import { solveLive } from "./live-solution";
import type { Mat3, Vec3 } from "./vectors";

const FOLDER = new URL("../../../tests/golden/", import.meta.url);
const TOLERANCE = 1e-6;

interface IntrinsicsJson {
  width_px: number;
  height_px: number;
  fx_px: number;
  fy_px: number;
  cx_px: number;
  cy_px: number;
  distortion: Distortion;
}

interface Golden {
  priors: { pixel_px: number; focal: number; k1: number };
  points_enu_m: Vec3[];
  pixels_px: Pixel[];
  used: boolean[];
  refined_from: IntrinsicsJson | null;
  start: { R: Mat3; C: Vec3; intrinsics: IntrinsicsJson };
  expected: {
    R: Mat3;
    C: Vec3;
    intrinsics: IntrinsicsJson;
    projected_px: Pixel[];
    leave_one_out_px: number[];
  };
}

function intrinsics(json: IntrinsicsJson): Intrinsics {
  return {
    widthPx: json.width_px,
    heightPx: json.height_px,
    fxPx: json.fx_px,
    fyPx: json.fy_px,
    cxPx: json.cx_px,
    cyPx: json.cy_px,
    distortion: json.distortion,
  };
}

const NAMES = readdirSync(FOLDER).filter((name) => name.startsWith("registration_"));

describe("the server's golden registrations", () => {
  it("are there", () => {
    expect(NAMES.length).toBeGreaterThanOrEqual(4);
  });

  it.each(NAMES)("%s: same camera, residuals and leave-one-out", (name) => {
    const golden = JSON.parse(readFileSync(new URL(name, FOLDER), "utf8")) as Golden;
    const { R, C, intrinsics: at } = golden.start;
    const start: Camera = { intrinsics: intrinsics(at), camFromWorld: R, center: C };
    const solution = solveLive(
      start,
      golden.points_enu_m.map((point, index) => ({ point, pixel: golden.pixels_px[index] ?? [0, 0] })),
      {
        used: golden.used,
        refinedFrom: golden.refined_from === null ? null : intrinsics(golden.refined_from),
        priors: { pixelPx: golden.priors.pixel_px, focal: golden.priors.focal, k1: golden.priors.k1 },
      },
    );
    const { expected } = golden;
    const off = (a: number | undefined | null, b: number): number => Math.abs((a ?? Number.NaN) - b);
    const differences = [
      ...expected.C.map((value, axis) => off(solution.camera.center[axis], value)),
      ...expected.R.flatMap((row, i) => row.map((value, j) => off(solution.camera.camFromWorld[i]?.[j], value))),
      off(solution.camera.intrinsics.fxPx, expected.intrinsics.fx_px),
      off(solution.camera.intrinsics.distortion[0], expected.intrinsics.distortion[0]),
      ...expected.projected_px.flatMap(([u, v], i) => {
        const [seenU, seenV] = golden.pixels_px[i] ?? [Number.NaN, Number.NaN];
        const [du, dv] = solution.residualsPx[i] ?? [Number.NaN, Number.NaN];
        return [off(seenU + du, u), off(seenV + dv, v)];
      }),
      ...expected.leave_one_out_px.map((value, i) => off(solution.leaveOneOutPx[i], value)),
    ];
    expect(Math.max(...differences)).toBeLessThan(TOLERANCE);
  });
});
