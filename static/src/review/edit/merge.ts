/**
 * Two people changed one box: which values differ, and whose is taken, one by one.
 *
 * Place is one value, because half of one place and half of another is nobody's.
 */
import { changeBetween, type Bearings, type LocalBox } from "./box";

export const PARTS = ["place", "heading_deg", "length_m", "width_m", "height_m"] as const;
export type Part = (typeof PARTS)[number];
export type Side = "mine" | "theirs";

export interface Difference {
  readonly part: Part;
  readonly name: string;
  readonly mine: string;
  readonly theirs: string;
}

const NAMES: Readonly<Record<Part, string>> = {
  place: "Place",
  heading_deg: "Heading",
  length_m: "Length",
  width_m: "Width",
  height_m: "Height",
};

/** Below this two values are one: a millimetre, a hundredth of a degree. */
const SAME = { metres: 0.001, degrees: 0.01 } as const;

export function differences(
  generated: LocalBox,
  mine: LocalBox,
  theirs: LocalBox,
  bearings: Bearings,
): readonly Difference[] {
  const apart = changeBetween(theirs, mine, bearings);
  return PARTS.filter((part) =>
    part === "place"
      ? Math.hypot(apart.across_m, apart.away_m) > SAME.metres
      : Math.abs(apart[part]) > (part === "heading_deg" ? SAME.degrees : SAME.metres),
  ).map((part) => ({
    part,
    name: NAMES[part],
    mine: inWords(part, mine, generated, bearings),
    theirs: inWords(part, theirs, generated, bearings),
  }));
}

/** Takes each differing part from one side or the other. */
export function merged(
  mine: LocalBox,
  theirs: LocalBox,
  choices: ReadonlyMap<Part, Side>,
): LocalBox {
  const of = (part: Part): LocalBox => (choices.get(part) === "theirs" ? theirs : mine);
  const { east_m, north_m, up_m } = of("place");
  return {
    east_m,
    north_m,
    up_m,
    heading_deg: of("heading_deg").heading_deg,
    length_m: of("length_m").length_m,
    width_m: of("width_m").width_m,
    height_m: of("height_m").height_m,
  };
}

function inWords(part: Part, box: LocalBox, generated: LocalBox, bearings: Bearings): string {
  if (part === "place") {
    const { across_m: across, away_m: away } = changeBetween(generated, box, bearings);
    const sideways = `${Math.abs(across).toFixed(1)} m ${across < 0 ? "left" : "right"}`;
    return `${sideways}, ${Math.abs(away).toFixed(1)} m ${away < 0 ? "nearer" : "farther"}`;
  }
  return part === "heading_deg" ? `${box[part].toFixed(1)}°` : `${box[part].toFixed(1)} m`;
}
