/**
 * Picking and dragging keypoints on the photograph, ahead of the gestures that move the view.
 *
 * A press near a point takes it (the nearest within a generous radius); dragging moves it by the
 * hand's way divided by the zoom, so it is finer than a pixel, and with Shift a tenth of that. The
 * point never jumps to the pointer.
 */
import type { Pixel } from "../../geometry/camera";
import { toImage, toScreen, type Point as ScreenPoint } from "../../viewer/view";
import type { Viewer } from "../../viewer/viewer";
import type { Editor } from "../editor";
import type { Loupe } from "./loupe";

const HIT_PX = { mouse: 16, pen: 20, touch: 28 } as const;
const TREMOR_PX = 3;
const FINE = 0.1;

interface Drag {
  readonly key: string;
  readonly pointerId: number;
  readonly stroke: string;
  pixel: Pixel;
  last: ScreenPoint;
  way: number;
}

export class PointGestures {
  private drag: Drag | null = null;
  private strokes = 0;

  constructor(
    private readonly viewer: Viewer,
    private readonly editor: Editor,
    private readonly loupe: Loupe,
    private readonly onPick: (key: string) => void,
  ) {
    const { surface } = viewer;
    surface.addEventListener("pointerdown", this.onDown, { capture: true });
    surface.addEventListener("pointermove", this.onMove, { capture: true });
    surface.addEventListener("pointerup", this.onUp, { capture: true });
    surface.addEventListener("pointercancel", this.onUp, { capture: true });
    surface.addEventListener("pointerleave", () => {
      if (this.drag === null) {
        loupe.hide();
      }
    });
  }

  private readonly onDown = (event: PointerEvent): void => {
    this.loupe.hide();
    if (event.button !== 0 || this.drag !== null) {
      return;
    }
    const at = this.viewer.pointAt(event);
    const hit = this.nearest(at, HIT_PX[event.pointerType as keyof typeof HIT_PX]);
    const pixel = hit?.pixel ?? null;
    if (hit === null || pixel === null || this.editor.armed !== null) {
      return;
    }
    event.stopImmediatePropagation();
    event.preventDefault();
    this.viewer.surface.setPointerCapture(event.pointerId);
    this.strokes += 1;
    const stroke = `drag-${this.strokes}`;
    this.drag = { key: hit.key, pointerId: event.pointerId, stroke, pixel, last: at, way: 0 };
    this.onPick(hit.key);
    this.showLoupe(pixel, at);
  };

  private readonly onMove = (event: PointerEvent): void => {
    const at = this.viewer.pointAt(event);
    const { drag } = this;
    if (drag === null) {
      if (event.pointerType === "mouse" && event.buttons === 0) {
        this.showLoupe(toImage(this.viewer.currentView(), at), at);
      }
      return;
    }
    if (event.pointerId !== drag.pointerId) {
      return;
    }
    event.stopImmediatePropagation();
    const [dx, dy] = [at[0] - drag.last[0], at[1] - drag.last[1]];
    drag.way += Math.hypot(dx, dy);
    drag.last = at;
    if (drag.way < TREMOR_PX && !this.editor.isDragging) {
      return; // a hand that only picks does not move what it picks
    }
    const factor = (event.shiftKey ? FINE : 1) / this.viewer.currentView().scale;
    drag.pixel = [drag.pixel[0] + dx * factor, drag.pixel[1] + dy * factor];
    this.editor.isDragging = true;
    this.editor.movePixel(drag.key, drag.pixel, drag.stroke);
    this.showLoupe(drag.pixel, at);
  };

  private readonly onUp = (event: PointerEvent): void => {
    if (this.drag?.pointerId !== event.pointerId) {
      return;
    }
    event.stopImmediatePropagation();
    this.drag = null;
    this.loupe.hide();
    if (this.editor.isDragging) {
      this.editor.isDragging = false;
      this.editor.tell("points");
    }
  };

  private nearest(at: ScreenPoint, within: number): { key: string; pixel: Pixel | null } | null {
    const view = this.viewer.currentView();
    let best: { key: string; pixel: Pixel | null } | null = null;
    let least = within;
    for (const point of this.editor.points) {
      if (point.pixel !== null) {
        const [x, y] = toScreen(view, point.pixel);
        const away = Math.hypot(x - at[0], y - at[1]);
        // Of two points at the same place the selected one is meant.
        if (away < least || (away === least && point.key === this.editor.selectedKey)) {
          [best, least] = [point, away];
        }
      }
    }
    return best;
  }

  private showLoupe(pixel: Pixel, at: ScreenPoint): void {
    const { clientWidth: width, clientHeight: height } = this.viewer.surface;
    this.loupe.show(pixel, at, this.viewer.currentView().scale, { width, height });
  }
}
