/** Two fingers zoom about their middle and carry the image along with it. */
import type { Point } from "../view";
import type { ViewControl } from "../viewer";

export class PinchZoom {
  private readonly fingers = new Map<number, Point>();

  constructor(private readonly control: ViewControl) {
    const { surface } = control;
    surface.addEventListener("pointerdown", this.onDown);
    surface.addEventListener("pointermove", this.onMove);
    surface.addEventListener("pointerup", this.onEnd);
    surface.addEventListener("pointercancel", this.onEnd);
  }

  private readonly onDown = (event: PointerEvent): void => {
    if (event.pointerType === "touch" && this.fingers.size < 2) {
      this.fingers.set(event.pointerId, this.control.pointAt(event));
    }
  };

  private readonly onMove = (event: PointerEvent): void => {
    if (!this.fingers.has(event.pointerId)) {
      return;
    }
    const before = [...this.fingers.values()];
    this.fingers.set(event.pointerId, this.control.pointAt(event));
    const [a, b] = before;
    const [c, d] = [...this.fingers.values()];
    if (a === undefined || b === undefined || c === undefined || d === undefined) {
      return;
    }
    const pinch = pinchBetween([a, b], [c, d]);
    this.control.pan(pinch.dx, pinch.dy);
    this.control.zoom(pinch.at, pinch.factor);
  };

  private readonly onEnd = (event: PointerEvent): void => {
    this.fingers.delete(event.pointerId);
  };
}

/** The pan and the zoom that carry two fingers from one place to another. */
export function pinchBetween(
  [a, b]: readonly [Point, Point],
  [c, d]: readonly [Point, Point],
): { dx: number; dy: number; at: Point; factor: number } {
  const spread = (p: Point, q: Point): number => Math.max(1, Math.hypot(p[0] - q[0], p[1] - q[1]));
  const at: Point = [(c[0] + d[0]) / 2, (c[1] + d[1]) / 2];
  return {
    dx: at[0] - (a[0] + b[0]) / 2,
    dy: at[1] - (a[1] + b[1]) / 2,
    at,
    factor: spread(c, d) / spread(a, b),
  };
}
