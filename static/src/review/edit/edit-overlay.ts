/** Draws the box that is being edited, live, and the generated one as a ghost beside it. */
import type { Camera } from "../../geometry/camera";
import { Lines } from "../../viewer/overlay/lines";
import { addBox, addGhost } from "../../viewer/overlay/pose-overlay";
import type { View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import { projectBox, type LocalBox } from "./box";

export class EditOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  show(camera: Camera, generated: LocalBox, draft: LocalBox): void {
    const { lines } = this;
    lines?.clear();
    if (lines !== null) {
      const group = lines.group("overlay-draft");
      addGhost(lines, group, projectBox(camera, generated));
      addBox(lines, group, projectBox(camera, draft));
    }
  }

  hide(): void {
    this.lines?.clear();
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }
}
