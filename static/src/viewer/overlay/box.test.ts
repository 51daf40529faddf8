import { describe, expect, it } from "vitest";
import type { Point } from "../view";
import { area, crossing, drawBox } from "./box";
import { arrowHead, polygonPath, rectPath } from "./paths";

type Point3 = readonly [number, number, number];

/** Corners of a box (vessel axes: forward, port, up) in the agreed order. */
function corners(length: number, width: number, height: number): Point3[] {
  const bottom: Point3[] = [
    [length / 2, width / 2, 0],
    [length / 2, -width / 2, 0],
    [-length / 2, -width / 2, 0],
    [-length / 2, width / 2, 0],
  ];
  return [...bottom, ...bottom.map(([x, y]): Point3 => [x, y, height])];
}

/** A pinhole camera at `eye` looking along -port, so that the vessel's port side faces it. */
function fromPort(eye: Point3): (point: Point3) => Point {
  return ([x, y, z]) => {
    const [right, down, depth] = [-(x - eye[0]), -(z - eye[2]), eye[1] - y];
    return [(1000 * right) / depth + 640, (1000 * down) / depth + 480];
  };
}

const BOX = corners(40, 8, 6);

describe("the projected box", () => {
  it("sees port, bow and top from ahead of the port side and above", () => {
    const drawing = drawBox(BOX.map(fromPort([60, 80, 30])));
    expect(drawing?.bowIsSeen).toBe(true);
    expect(drawing?.visibleEdges).toHaveLength(9);
    expect(drawing?.hiddenEdges).toHaveLength(3);
  });

  it("hides the bow when seen from astern, and exactly the edges at the far bottom corner", () => {
    const project = fromPort([-60, 80, 30]);
    const drawing = drawBox(BOX.map(project));
    expect(drawing?.bowIsSeen).toBe(false);
    const farCorner = project([20, -4, 0]); // bow-starboard
    for (const [a, b] of drawing?.hiddenEdges ?? []) {
      expect([a, b]).toContainEqual(farCorner);
    }
  });

  it("finds the axes exactly, perspective included", () => {
    const project = fromPort([60, 80, 30]);
    const axes = drawBox(BOX.map(project))?.axes;
    const expected = { forward: [20, 0, 3], port: [0, 4, 3], up: [0, 0, 6] } as const;
    for (const name of ["forward", "port", "up"] as const) {
      const [from, to] = axes?.[name] ?? [[0, 0] as const, [0, 0] as const];
      const middle = project([0, 0, 3]);
      const end = project(expected[name]);
      expect(from[0]).toBeCloseTo(middle[0], 6);
      expect(from[1]).toBeCloseTo(middle[1], 6);
      expect(to[0]).toBeCloseTo(end[0], 6);
      expect(to[1]).toBeCloseTo(end[1], 6);
    }
  });

  it("draws nothing when a corner is missing or behind the camera", () => {
    const points = BOX.map(fromPort([60, 80, 30]));
    expect(drawBox(points.slice(1))).toBeNull();
    expect(drawBox([[Number.NaN, 0], ...points.slice(1)])).toBeNull();
  });

  it("calls clockwise positive, with y pointing down", () => {
    const square: Point[] = [
      [0, 0],
      [2, 0],
      [2, 2],
      [0, 2],
    ];
    expect(area(square)).toBe(8);
    expect(area(square.toReversed())).toBe(-8);
  });

  it("has no crossing for parallel lines", () => {
    expect(crossing([0, 0], [1, 1], [1, 0], [2, 1])).toBeNull();
    expect(crossing([0, 0], [2, 2], [0, 2], [2, 0])).toEqual([1, 1]);
  });
});

describe("paths in screen pixels", () => {
  const view = { scale: 2, x: 10, y: 20 };

  it("shifts pixel centres to SVG's corners before scaling", () => {
    expect(rectPath({ x1: 0, y1: 0, x2: 1, y2: 1 }, view)).toBe(
      "M11.00 21.00L13.00 21.00L13.00 23.00L11.00 23.00Z",
    );
  });

  it("draws no polygon with a point that is not finite", () => {
    const points: Point[] = [
      [0, 0],
      [1, 0],
      [Number.NaN, 1],
    ];
    expect(polygonPath(points, view)).toBe("");
  });

  it("leaves out the head of an arrow shorter than it", () => {
    const at = (x: number): string => arrowHead([[0, 0], [x, 0]], view, 9);
    expect(at(1)).toBe("");
    expect(at(100)).toBe("M202.00 25.50L211.00 21.00L202.00 16.50");
  });
});
