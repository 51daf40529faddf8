import { describe, expect, it } from "vitest";
import { cameraFrom, isInImage, onWater, project, projectFromCam, unproject } from "./camera";
import { distort, oneToOneRadius, undistort, type Distortion } from "./distortion";
import { rotvecFromMatrix } from "./rotation";
import { apply, multiply, transpose, type Vec3 } from "./vectors";

const LENS: Distortion = [-0.21, 0.05, 0.001, -0.002, 0.01];
const CAMERA = cameraFrom(
  { widthPx: 2560, heightPx: 1920, fxPx: 6570, fyPx: 6572, cxPx: 1279.5, cyPx: 959.5, distortion: LENS },
  [1.31, -0.78, 0.81],
  [3, -4, 30],
);

describe("camera", () => {
  it("projects to the pixels that the server's camera gives", () => {
    const expected: readonly [Vec3, readonly [number, number]][] = [
      [[89.752, 48.478, 36.923], [1208.1244899462602, 1167.326128759974]],
      [[543.267, 369.349, 109.46], [800.3974389830432, 836.2930626920529]],
      [[1379.285, 673.176, 218.844], [1761.5483442475322, 788.5226339348062]],
    ];
    for (const [point, [u, v]] of expected) {
      const shown = project(CAMERA, point);
      expect(shown?.[0]).toBeCloseTo(u, 8);
      expect(shown?.[1]).toBeCloseTo(v, 8);
    }
  });

  it("sees along the line on which a pixel's point lies", () => {
    const ray = unproject(CAMERA, [400.25, 1500.5]);
    const expected = [0.7848649256660474, 0.6192944784601391, 0.02148016312821305];
    expected.forEach((part, axis) => {
      expect(ray?.[axis]).toBeCloseTo(part, 10);
    });
  });

  it("has no pixel for what lies behind it or beside its lens", () => {
    expect(project(CAMERA, [-90, -50, 20])).toBeNull();
    expect(projectFromCam(CAMERA.intrinsics, [0, 0, 0])).toBeNull();
    expect(projectFromCam(CAMERA.intrinsics, [oneToOneRadius(LENS) * 1.01, 0, 1])).toBeNull();
  });

  it("finds the water under a pixel, and none above the horizon", () => {
    const level = cameraFrom({ ...CAMERA.intrinsics, distortion: [0, 0, 0, 0, 0] }, [Math.PI / 2, 0, 0], [0, 0, 25]);
    const point = onWater(level, [1279.5, 959.5 + 657.2], 0);
    expect(point?.[1]).toBeCloseTo(250, 6);
    expect(point?.[2]).toBeCloseTo(0, 9);
    expect(onWater(level, [1279.5, 900], 0)).toBeNull();
  });

  it("counts half a pixel around the outermost centres as image", () => {
    expect(isInImage(CAMERA.intrinsics, [-0.5, 1919.5])).toBe(true);
    expect(isInImage(CAMERA.intrinsics, [2559.6, 0])).toBe(false);
  });
});

describe("distortion", () => {
  it("is undone to a billionth of the normalised plane", () => {
    for (const lens of [LENS, [-0.3, 0, 0, 0, 0], [0.2, -0.1, 0, 0.001, 0]] as Distortion[]) {
      for (const x of [-0.25, 0, 0.11]) {
        for (const y of [-0.2, 0.07, 0.24]) {
          const shown = distort(lens, [x, y]) ?? [Number.NaN, Number.NaN];
          const ideal = undistort(lens, shown);
          expect(ideal?.[0]).toBeCloseTo(x, 10);
          expect(ideal?.[1]).toBeCloseTo(y, 10);
        }
      }
    }
  });

  it("is trusted up to where it turns back", () => {
    expect(oneToOneRadius([-0.3, 0, 0, 0, 0])).toBeCloseTo(Math.sqrt(1 / 0.9), 12);
    expect(oneToOneRadius([0, 0, 0, 0, 0])).toBe(Infinity);
    expect(oneToOneRadius([0.2, 0.1, 0, 0, 0.1])).toBe(Infinity);
    const radius = oneToOneRadius([-0.4, 0.1, 0, 0, -0.02]);
    expect(1 - 1.2 * radius ** 2 + 0.5 * radius ** 4 - 0.14 * radius ** 6).toBeCloseTo(0, 9);
  });
});

describe("rotation", () => {
  it("comes back from its matrix, also for small and half turns", () => {
    const vectors: Vec3[] = [[0, 0, 0], [1e-9, 0, -2e-9], [0.3, -1.2, 2.1], [0, Math.PI - 1e-9, 0], [-2.2, 2.1, 0.4]];
    for (const rotvec of vectors) {
      const { camFromWorld: R } = cameraFrom(CAMERA.intrinsics, rotvec, [0, 0, 0]);
      const back = rotvecFromMatrix(R);
      rotvec.forEach((part, axis) => {
        expect(back[axis]).toBeCloseTo(part, 7);
      });
      expect(apply(multiply(R, transpose(R)), [1, 2, 3])[2]).toBeCloseTo(3, 12);
    }
  });
});
