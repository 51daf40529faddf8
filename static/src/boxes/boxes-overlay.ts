/** Draws the boxes with their classes; the chosen one, or the one being drawn, with its corners. */
import { cornerOf, CORNERS } from "../review/missed/missed-box";
import { Lines } from "../viewer/overlay/lines";
import { rectPath } from "../viewer/overlay/paths";
import { middle, toScreen, type Rect, type View } from "../viewer/view";
import type { Overlay } from "../viewer/viewer";
import type { Box } from "./scene";

const GRIP_PX = 5;

export class BoxesOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  /** `live` is what a drag makes of the chosen box, or a box that has no class yet. */
  show(boxes: readonly Box[], chosen: Box | null, live: Rect | null): void {
    const { lines } = this;
    if (lines === null) {
      return;
    }
    lines.clear();
    for (const box of boxes) {
      if (box !== chosen || live === null) {
        this.addBox(lines, box.rect, box.vesselClass, box === chosen);
      }
    }
    if (live !== null) {
      this.addBox(lines, live, chosen?.vesselClass ?? "missed", true);
    }
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }

  private addBox(lines: Lines, rect: Rect, name: string, isChosen: boolean): void {
    const group = lines.group("overlay-drawn");
    group.dataset["box"] = name;
    lines.add(group, `layer-${name}${isChosen ? " is-chosen" : ""}`, (view) => rectPath(rect, view));
    lines.label(group, `layer-${name}`, name === "missed" ? "class?" : name, [middle(rect)[0], rect.y1]);
    if (!isChosen) {
      return;
    }
    for (const corner of CORNERS) {
      lines.add(group, "layer-grip", (view) => {
        const [x, y] = toScreen(view, cornerOf(rect, corner));
        return `M${x - GRIP_PX} ${y - GRIP_PX}h${2 * GRIP_PX}v${2 * GRIP_PX}h${-2 * GRIP_PX}Z`;
      });
    }
  }
}
