/** Draws the box that is being drawn or was chosen, with its corners to grip. */
import { Lines } from "../../viewer/overlay/lines";
import { rectPath } from "../../viewer/overlay/paths";
import { toScreen, type Rect, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import { cornerOf, CORNERS } from "./missed-box";

const GRIP_PX = 5;

export class MissedOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  show(rect: Rect | null): void {
    const { lines } = this;
    lines?.clear();
    if (lines === null || rect === null) {
      return;
    }
    const group = lines.group("overlay-drawn");
    lines.add(group, "layer-missed", (view) => rectPath(rect, view));
    for (const corner of CORNERS) {
      lines.add(group, "layer-grip", (view) => {
        const [x, y] = toScreen(view, cornerOf(rect, corner));
        return `M${x - GRIP_PX} ${y - GRIP_PX}h${2 * GRIP_PX}v${2 * GRIP_PX}h${-2 * GRIP_PX}Z`;
      });
    }
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }
}
