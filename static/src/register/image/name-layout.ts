/**
 * Names of all marks on the photograph, written where they cover nothing: the selected keypoint's
 * first, then those that wait for a person, the other keypoints, and projected landmarks last. A
 * name without room comes with the pointer or the focus.
 */
import type { View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import { placeLabels, widthOf } from "../labels";

export interface NamedMark {
  readonly group: SVGGElement;
  readonly label: SVGTextElement;
  readonly name: string;
  readonly x: number;
  readonly y: number;
  /** From the edge of the mark to its name. */
  readonly gap: number;
  /** Lower comes first. */
  readonly rank: number;
}

/** The rank of a landmark that is only projected. */
export const PROJECTED = 3;

export class NameLayout implements Overlay {
  private group: SVGGElement | null = null;

  constructor(private readonly marks: (view: View) => readonly NamedMark[]) {}

  attach(group: SVGGElement): void {
    this.group = group;
  }

  draw(view: View): void {
    const ranked = [...this.marks(view)].sort((a, b) => a.rank - b.rank);
    const room = this.group?.ownerSVGElement?.clientWidth ?? Infinity;
    const sides = placeLabels(
      ranked.map(({ x, y, name, rank }) => ({ x, y, width: widthOf(name), isMinor: rank === PROJECTED })),
      room,
    );
    ranked.forEach(({ group, label, gap }, index) => {
      const side = sides[index] ?? null;
      group.classList.toggle("is-nameless", side === null);
      label.setAttribute("text-anchor", side === "left" ? "end" : "start");
      label.setAttribute("x", String(side === "left" ? -gap : gap));
    });
  }
}
