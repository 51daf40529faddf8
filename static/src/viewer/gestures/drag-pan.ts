/** One pointer pressed and moved drags the image; pressed and released in place is a tap. */
import type { Point } from "../view";
import type { ViewControl } from "../viewer";

/** A hand that trembles less than this still taps. */
const TAP_SLOP_PX = 4;

export class DragPan {
  private readonly pointers = new Set<number>();
  private start: Point = [0, 0];
  private last: Point = [0, 0];
  private state: "idle" | "pressed" | "dragging" = "idle";

  constructor(
    private readonly control: ViewControl,
    private readonly onTap: (at: Point) => void,
  ) {
    const { surface } = control;
    surface.addEventListener("pointerdown", this.onDown);
    surface.addEventListener("pointermove", this.onMove);
    surface.addEventListener("pointerup", this.onUp);
    surface.addEventListener("pointercancel", this.onCancel);
  }

  private readonly onDown = (event: PointerEvent): void => {
    if (event.button !== 0 && event.button !== 1) {
      return;
    }
    this.pointers.add(event.pointerId);
    if (this.pointers.size > 1) {
      this.stop(); // two fingers pinch
      return;
    }
    this.control.surface.setPointerCapture(event.pointerId);
    this.start = this.last = this.control.pointAt(event);
    this.state = "pressed";
  };

  private readonly onMove = (event: PointerEvent): void => {
    if (this.state === "idle" || this.pointers.size !== 1) {
      return;
    }
    const at = this.control.pointAt(event);
    if (this.state === "pressed") {
      if (Math.hypot(at[0] - this.start[0], at[1] - this.start[1]) < TAP_SLOP_PX) {
        return;
      }
      this.state = "dragging";
      this.control.surface.classList.add("is-dragging");
    }
    this.control.pan(at[0] - this.last[0], at[1] - this.last[1]);
    this.last = at;
  };

  private readonly onUp = (event: PointerEvent): void => {
    this.pointers.delete(event.pointerId);
    const tapped = this.state === "pressed" && event.button === 0;
    this.stop();
    if (tapped) {
      this.onTap(this.control.pointAt(event));
    }
  };

  private readonly onCancel = (event: PointerEvent): void => {
    this.pointers.delete(event.pointerId);
    this.stop();
  };

  private stop(): void {
    this.state = "idle";
    this.control.surface.classList.remove("is-dragging");
  }
}
