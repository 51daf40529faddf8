/** Draws where AIS puts each candidate, numbered as in the list, and the box they are held against. */
import { Lines } from "../../viewer/overlay/lines";
import { polygonPath, rectPath } from "../../viewer/overlay/paths";
import { boundsOf, middle, type Point, type Rect, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";

export interface DrawnCandidate {
  readonly label: string;
  readonly segment: readonly Point[];
}

export interface DrawnCandidates {
  readonly target: Rect;
  readonly others: readonly Rect[];
  readonly candidates: readonly DrawnCandidate[];
  readonly chosen: number;
}

export class CandidateOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  show({ target, others, candidates, chosen }: DrawnCandidates): void {
    const { lines } = this;
    if (lines === null) {
      return;
    }
    lines.clear();
    const boxes = lines.group("overlay-targets");
    for (const rect of others) {
      lines.add(boxes, "layer-free", (view) => rectPath(rect, view));
    }
    lines.add(boxes, "layer-target", (view) => rectPath(target, view));
    candidates.forEach(({ label, segment }, index) => {
      const group = lines.group(`overlay-candidate${index === chosen ? " is-chosen" : ""}`);
      group.dataset["candidate"] = String(index);
      lines.add(group, "layer-candidate", (view) => polygonPath(segment, view));
      const bounds = boundsOf(segment);
      if (bounds !== null) {
        lines.label(group, "layer-candidate", label, [middle(bounds)[0], bounds.y1]);
      }
    });
  }

  hide(): void {
    this.lines?.clear();
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }
}
