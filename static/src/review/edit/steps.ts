/** What a key press in edit mode does to the box: one step, or with Shift a tenth of it. */
import type { Press } from "../modes";
import {
  flipped,
  movedAlong,
  resized,
  turnedTo,
  type Bearings,
  type Dimension,
  type LocalBox,
} from "./box";

/** One press: a metre, or a degree. */
const STEP = 1;
const FINE = 0.1;

type Step = (box: LocalBox, bearings: Bearings, step: number) => LocalBox;

const size =
  (dimension: Dimension, sign: 1 | -1): Step =>
  (box, _, step) =>
    resized(box, dimension, box[dimension] + sign * step);

const STEPS: ReadonlyMap<string, Step> = new Map<string, Step>([
  ["edit.move-left", (box, bearings, step) => movedAlong(box, bearings, -step, 0)],
  ["edit.move-right", (box, bearings, step) => movedAlong(box, bearings, step, 0)],
  ["edit.move-away", (box, bearings, step) => movedAlong(box, bearings, 0, step)],
  ["edit.move-nearer", (box, bearings, step) => movedAlong(box, bearings, 0, -step)],
  ["edit.turn-left", (box, _, step) => turnedTo(box, box.heading_deg - step)],
  ["edit.turn-right", (box, _, step) => turnedTo(box, box.heading_deg + step)],
  ["edit.flip", (box) => flipped(box)],
  ["edit.longer", size("length_m", 1)],
  ["edit.shorter", size("length_m", -1)],
  ["edit.wider", size("width_m", 1)],
  ["edit.narrower", size("width_m", -1)],
  ["edit.higher", size("height_m", 1)],
  ["edit.lower", size("height_m", -1)],
]);

/** The box after a command; null when the command is none of these. */
export function stepped(
  commandId: string,
  { fine }: Press,
  box: LocalBox,
  bearings: Bearings,
): LocalBox | null {
  const step = STEPS.get(commandId);
  return step === undefined ? null : step(box, bearings, fine ? FINE : STEP);
}
