/** The wheel zooms at the pointer; a trackpad's pinch arrives as a wheel with Ctrl. */
import type { ViewControl } from "../viewer";

const LINE_PX = 16;
const PAGE_PX = 400;
const ZOOM_PER_PX = 0.0018;
const PINCH_GAIN = 5;

export class WheelZoom {
  constructor(private readonly control: ViewControl) {
    control.surface.addEventListener("wheel", this.onWheel, { passive: false });
  }

  private readonly onWheel = (event: WheelEvent): void => {
    event.preventDefault();
    this.control.zoom(this.control.pointAt(event), wheelFactor(event));
  };
}

/** How much one wheel event zooms: exponential, so that there and back cancel exactly. */
export function wheelFactor(event: {
  deltaY: number;
  deltaMode: number;
  ctrlKey: boolean;
}): number {
  const unit = event.deltaMode === 1 ? LINE_PX : event.deltaMode === 2 ? PAGE_PX : 1;
  const gain = event.ctrlKey ? PINCH_GAIN : 1;
  const distance = Math.max(-240, Math.min(240, event.deltaY * unit * gain));
  return Math.exp(-distance * ZOOM_PER_PX);
}
