/**
 * Which names can be written beside their marks without covering each other: to the right where
 * there is room, else to the left, else not at all. The first in the list have the first choice.
 */
export type Side = "right" | "left" | null;

export interface Label {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  /** A mark that others may write over. */
  readonly isMinor?: boolean;
}

interface Box {
  readonly x1: number;
  readonly y1: number;
  readonly x2: number;
  readonly y2: number;
}

const MARK = 10;
const GAP = 13;
const HEIGHT = 17;

/** The side of each label, in their order; `room` is the width of the screen. */
export function placeLabels(labels: readonly Label[], room: number): Side[] {
  const taken: Box[] = labels.map(({ x, y }) => ({
    x1: x - MARK,
    y1: y - MARK + 3,
    x2: x + MARK,
    y2: y + MARK - 3,
  }));
  return labels.map((label, own) => {
    for (const side of ["right", "left"] as const) {
      const box = boxOf(label, side);
      const gives = (index: number): boolean =>
        index === own || (label.isMinor !== true && labels[index]?.isMinor === true);
      const isFree = taken.every((other, index) => gives(index) || !overlap(box, other));
      if (isFree && box.x1 >= 0 && box.x2 <= room) {
        taken.push(box);
        return side;
      }
    }
    return null;
  });
}

function boxOf({ x, y, width }: Label, side: "right" | "left"): Box {
  const x1 = side === "right" ? x + GAP : x - GAP - width;
  return { x1, y1: y - HEIGHT / 2, x2: x1 + width, y2: y + HEIGHT / 2 };
}

export function overlap(a: Box, b: Box): boolean {
  return a.x1 < b.x2 && b.x1 < a.x2 && a.y1 < b.y2 && b.y1 < a.y2;
}

const WIDTHS = new Map<string, number>();
const FONT = "550 13px system-ui, sans-serif";

/** The width of a name as it is written beside marks, px. */
export function widthOf(name: string): number {
  const known = WIDTHS.get(name);
  if (known !== undefined) {
    return known;
  }
  const context = document.createElement("canvas").getContext("2d");
  if (context === null) {
    return name.length * 8;
  }
  context.font = FONT;
  const width = context.measureText(name).width + 4;
  WIDTHS.set(name, width);
  return width;
}
