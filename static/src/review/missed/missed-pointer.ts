/**
 * The pointer in missed-vessel mode: a drag draws a box, or moves and stretches the chosen one.
 * A second finger ends it, because two fingers zoom; the middle button still moves the view.
 */
import { toImage, toScreen, type Point, type Rect } from "../../viewer/view";
import type { Viewer } from "../../viewer/viewer";
import { contains, cornerOf, CORNERS, oppositeOf, type Corner } from "./missed-box";

/** How near a corner counts as the corner, screen pixels. */
const REACH_PX = { mouse: 12, touch: 26 } as const;

export type Grip =
  | { readonly kind: "draw"; readonly from: Point }
  | { readonly kind: "move"; readonly from: Point; readonly rect: Rect }
  | { readonly kind: "stretch"; readonly fixed: Point };

export interface PointerHooks {
  isActive(): boolean;
  /** The box that a drag would change; null for none. */
  chosen(): Rect | null;
  onDrag(grip: Grip, to: Point): void;
  onEnd(grip: Grip, to: Point): void;
  onAbandon(): void;
}

export class MissedPointer {
  private grip: Grip | null = null;
  private pointer: number | null = null;
  private readonly down = new Set<number>();

  constructor(
    private readonly viewer: Viewer,
    private readonly hooks: PointerHooks,
  ) {
    const { surface } = viewer;
    surface.addEventListener("pointerdown", this.onDown, { capture: true });
    surface.addEventListener("pointermove", this.onMove, { capture: true });
    surface.addEventListener("pointerup", this.onUp, { capture: true });
    surface.addEventListener("pointercancel", this.onUp, { capture: true });
  }

  private readonly onDown = (event: PointerEvent): void => {
    this.down.add(event.pointerId);
    if (!this.hooks.isActive() || event.button !== 0) {
      return;
    }
    if (this.down.size > 1) {
      this.abandon();
      return;
    }
    // The viewer's pinch may still need this finger, so the event goes on to it.
    this.viewer.surface.setPointerCapture(event.pointerId);
    this.pointer = event.pointerId;
    this.grip = this.gripAt(event);
  };

  private readonly onMove = (event: PointerEvent): void => {
    if (event.pointerId === this.pointer && this.grip !== null) {
      event.stopImmediatePropagation(); // neither pans nor pinches
      this.hooks.onDrag(this.grip, this.pixelOf(event));
    }
  };

  private readonly onUp = (event: PointerEvent): void => {
    this.down.delete(event.pointerId);
    if (event.pointerId !== this.pointer) {
      return;
    }
    const { grip } = this;
    this.pointer = null;
    this.grip = null;
    if (grip !== null && event.type === "pointerup") {
      this.hooks.onEnd(grip, this.pixelOf(event));
    } else {
      this.hooks.onAbandon();
    }
  };

  private abandon(): void {
    if (this.pointer !== null) {
      this.pointer = null;
      this.grip = null;
      this.hooks.onAbandon();
    }
  }

  private gripAt(event: PointerEvent): Grip {
    const from = this.pixelOf(event);
    const rect = this.hooks.chosen();
    if (rect === null) {
      return { kind: "draw", from };
    }
    const corner = this.cornerAt(rect, event);
    if (corner !== null) {
      return { kind: "stretch", fixed: cornerOf(rect, oppositeOf(corner)) };
    }
    return contains(rect, from) ? { kind: "move", from, rect } : { kind: "draw", from };
  }

  private cornerAt(rect: Rect, event: PointerEvent): Corner | null {
    const [x, y] = this.viewer.pointAt(event);
    const reach = event.pointerType === "touch" ? REACH_PX.touch : REACH_PX.mouse;
    const near = CORNERS.find((corner) => {
      const [cx, cy] = toScreen(this.viewer.currentView(), cornerOf(rect, corner));
      return Math.hypot(cx - x, cy - y) <= reach;
    });
    return near ?? null;
  }

  private pixelOf(event: PointerEvent): Point {
    return toImage(this.viewer.currentView(), this.viewer.pointAt(event));
  }
}
