import { describe, expect, it } from "vitest";
import { adjustMargin, frame } from "./framing";
import { pinchBetween } from "./gestures/pinch-zoom";
import { wheelFactor } from "./gestures/wheel-zoom";
import {
  boundsOf,
  centerOn,
  fillScreen,
  fitImage,
  fitRect,
  isVisible,
  keepInSight,
  MAX_SCALE,
  minScale,
  panBy,
  toImage,
  toScreen,
  zoomAt,
  type Point,
  type View,
} from "./view";

const SCREEN = { width: 900, height: 600 };
const IMAGE = { width: 2560, height: 1920 };
const VIEW: View = { scale: 0.37, x: -12.25, y: 40.5 };

function expectPoint(actual: Point, expected: Point): void {
  expect(actual[0]).toBeCloseTo(expected[0], 9);
  expect(actual[1]).toBeCloseTo(expected[1], 9);
}

describe("screen and image", () => {
  it("puts the centre of the first pixel half a pixel inside the image's corner", () => {
    expectPoint(toScreen({ scale: 4, x: 10, y: 20 }, [0, 0]), [12, 22]);
  });

  it("goes there and back without loss", () => {
    expectPoint(toImage(VIEW, toScreen(VIEW, [1234.567, 89.01])), [1234.567, 89.01]);
  });
});

describe("zooming and panning", () => {
  it("keeps the point under the pointer where it is", () => {
    const under = toImage(VIEW, [333.3, 222.2]);
    const zoomed = zoomAt(VIEW, [333.3, 222.2], 1.7, 0.01);
    expect(zoomed.scale).toBeCloseTo(VIEW.scale * 1.7);
    expectPoint(toImage(zoomed, [333.3, 222.2]), under);
  });

  it("stops at both ends without drifting", () => {
    const closest = zoomAt({ scale: MAX_SCALE, x: 5, y: 6 }, [100, 100], 3, 0.01);
    expect(closest).toEqual({ scale: MAX_SCALE, x: 5, y: 6 });
    expect(zoomAt(VIEW, [0, 0], 1e-9, 0.2).scale).toBe(0.2);
  });

  it("lets an image that fits be shown at half that size and no smaller", () => {
    expect(minScale(IMAGE, SCREEN)).toBeCloseTo(600 / 1920 / 2);
    expect(minScale({ width: 10, height: 10 }, SCREEN)).toBe(1);
  });

  it("never loses the image from sight", () => {
    const lost = keepInSight(panBy(VIEW, 1e6, -1e6), IMAGE, SCREEN);
    expect(lost.x).toBe(450);
    expect(lost.y).toBeCloseTo(300 - IMAGE.height * VIEW.scale);
  });

  it("turns the wheel there and back to the same zoom", () => {
    const forth = wheelFactor({ deltaY: -100, deltaMode: 0, ctrlKey: false });
    const back = wheelFactor({ deltaY: 100, deltaMode: 0, ctrlKey: false });
    expect(forth).toBeGreaterThan(1);
    expect(forth * back).toBeCloseTo(1, 12);
    const lines = wheelFactor({ deltaY: 3, deltaMode: 1, ctrlKey: false });
    expect(lines).toBeCloseTo(wheelFactor({ deltaY: 48, deltaMode: 0, ctrlKey: false }), 12);
  });

  it("reads two fingers as a pan of their middle and a zoom by their spread", () => {
    const pinch = pinchBetween(
      [
        [0, 0],
        [10, 0],
      ],
      [
        [0, 5],
        [20, 5],
      ],
    );
    expect(pinch).toEqual({ dx: 5, dy: 5, at: [10, 5], factor: 2 });
  });
});

describe("framing", () => {
  const object = { x1: 1000, y1: 900, x2: 1200, y2: 1000 };

  it("fits the whole image, centred", () => {
    const view = fitImage(IMAGE, SCREEN);
    expectPoint(toScreen(view, [IMAGE.width / 2 - 0.5, IMAGE.height / 2 - 0.5]), [450, 300]);
    expectPoint(toScreen(view, [-0.5, -0.5]), [50, 0]);
  });

  it("fits an object with its margin and centres it", () => {
    const view = fitRect(object, SCREEN, 0.5);
    expect(view.scale).toBeCloseTo(900 / 400);
    expectPoint(toScreen(view, [1100, 950]), [450, 300]);
  });

  it("does not blow a distant speck up without bound", () => {
    expect(fitRect({ x1: 5, y1: 5, x2: 6, y2: 6 }, SCREEN, 0).scale).toBe(8);
  });

  it("fits an object near the border without leaving room beside the image empty", () => {
    const corner = { x1: 10, y1: 20, x2: 110, y2: 70 };
    const view = frame("object", VIEW, corner, IMAGE, SCREEN, 2);
    expect(view.scale).toBeCloseTo(900 / 500);
    expectPoint(toScreen(view, [-0.5, -0.5]), [0, 0]);
    expect(isVisible(view, corner, SCREEN)).toBe(true);
  });

  it("keeps an object in sight that reaches out of the image", () => {
    const cut = { x1: -150, y1: 100, x2: 150, y2: 200 };
    const view = frame("object", VIEW, cut, IMAGE, SCREEN, 0.5);
    expect(isVisible(view, cut, SCREEN)).toBe(true);
    expect(toScreen(view, [-150, 100])[0]).toBeCloseTo(0);
  });

  it("centres an image smaller than the screen", () => {
    const view = fillScreen({ scale: 1, x: -500, y: 900 }, { width: 100, height: 60 }, SCREEN);
    expectPoint(toScreen(view, [49.5, 29.5]), [450, 300]);
  });

  it("leaves a free view alone while the next object is in sight", () => {
    const view = centerOn({ scale: 1, x: 0, y: 0 }, [1100, 900], SCREEN);
    expect(frame("free", view, object, IMAGE, SCREEN, 0.5)).toBe(view);
  });

  it("shifts a free view, at the same zoom, to an object out of sight", () => {
    const view = centerOn({ scale: 2, x: 0, y: 0 }, [100, 100], SCREEN);
    const next = frame("free", view, object, IMAGE, SCREEN, 0.5);
    expect(next.scale).toBe(2);
    expect(isVisible(next, object, SCREEN)).toBe(true);
  });

  it("widens and tightens the margin within bounds", () => {
    expect(adjustMargin(adjustMargin(0.6, 2), -2)).toBeCloseTo(0.6);
    expect(adjustMargin(0.6, -100)).toBe(0.05);
    expect(adjustMargin(0.6, 100)).toBe(6);
  });

  it("finds bounds of the finite points only", () => {
    expect(
      boundsOf([
        [1, 2],
        [Number.NaN, 5],
        [-3, 9],
      ]),
    ).toEqual({ x1: -3, y1: 2, x2: 1, y2: 9 });
    expect(boundsOf([[Number.NaN, 0]])).toBeNull();
  });
});
