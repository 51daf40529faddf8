/** The keys of drawing boxes; one key a class, the rest as in the review. */
import type { Command } from "../review/modes";
import type { VesselClass } from "./scene";

export const CLASSES: readonly VesselClass[] = [
  "ship",
  "ship_leaving_frame",
  "ship_moored",
  "ship_partial",
  "subvessel",
];

const step = (id: string, codes: readonly string[], meaning: string): Command => ({
  id: `boxes.${id}`,
  codes,
  shift: "fine",
  repeats: true,
  meaning,
});

export const BOX_COMMANDS: readonly Command[] = [
  ...CLASSES.map((name, index) => ({
    id: `boxes.class-${index + 1}`,
    codes: [`Digit${index + 1}`, `Numpad${index + 1}`],
    meaning: `The box is ${name}`,
  })),
  { id: "boxes.new", codes: ["KeyB"], meaning: "A new box in the middle of the view" },
  { id: "boxes.next-box", codes: ["KeyJ"], meaning: "Next box" },
  { id: "boxes.previous-box", codes: ["KeyK"], meaning: "Previous box" },
  step("left", ["ArrowLeft"], "Move the box 1 px to the left; with Shift a tenth"),
  step("right", ["ArrowRight"], "Move it to the right"),
  step("up", ["ArrowUp"], "Move it up"),
  step("down", ["ArrowDown"], "Move it down"),
  step("narrower", ["KeyA"], "Right edge 1 px to the left"),
  step("wider", ["KeyS"], "Right edge to the right"),
  step("lower", ["KeyX"], "Bottom edge up"),
  step("higher", ["KeyC"], "Bottom edge down"),
  { id: "boxes.delete", codes: ["Delete"], meaning: "Delete the chosen box" },
  { id: "boxes.undo", codes: ["Backspace", "KeyU"], meaning: "Undo" },
  { id: "boxes.leave", codes: ["Escape"], meaning: "Choose no box" },
  { id: "boxes.complete", codes: ["Enter", "NumpadEnter"], meaning: "Boxes complete, on to the next open image" },
  { id: "boxes.reopen", codes: ["Enter"], shift: "with", meaning: "Boxes not complete after all" },
  { id: "boxes.later", codes: ["KeyL"], meaning: "Later image" },
  { id: "boxes.earlier", codes: ["KeyH"], meaning: "Earlier image" },
  { id: "boxes.next-open", codes: ["KeyN"], meaning: "Next image that is not complete" },
  { id: "boxes.fit", codes: ["KeyZ"], meaning: "Fit the box, or the whole image" },
];

/** What a command does to a box, px: moves it, and moves its right and bottom edge. */
export const STEPS: ReadonlyMap<string, readonly [number, number, number, number]> = new Map([
  ["boxes.left", [-1, 0, 0, 0]],
  ["boxes.right", [1, 0, 0, 0]],
  ["boxes.up", [0, -1, 0, 0]],
  ["boxes.down", [0, 1, 0, 0]],
  ["boxes.narrower", [0, 0, -1, 0]],
  ["boxes.wider", [0, 0, 1, 0]],
  ["boxes.lower", [0, 0, 0, -1]],
  ["boxes.higher", [0, 0, 0, 1]],
]);
