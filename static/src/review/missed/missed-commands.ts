/** The keys of missed-vessel mode: one key a reason, the rest for those without a mouse. */
import type { Command } from "../modes";
import { MISSED_REASONS } from "../surroundings";
import { MISSED_WORDS } from "../words";

const step = (id: string, codes: readonly string[], meaning: string): Command => ({
  id: `missed.${id}`,
  codes,
  shift: "fine",
  repeats: true,
  meaning,
});

export const MISSED_COMMANDS: readonly Command[] = [
  ...MISSED_REASONS.map((reason, index) => ({
    id: `missed.${reason}`,
    codes: [`Digit${index + 1}`, `Numpad${index + 1}`],
    meaning: `Store the box: ${MISSED_WORDS[reason]}`,
  })),
  { id: "missed.new", codes: ["KeyN"], meaning: "A new box in the middle of the view" },
  step("left", ["ArrowLeft"], "Move the box; with Shift a tenth"),
  step("right", ["ArrowRight"], "Move the box to the right"),
  step("up", ["ArrowUp"], "Move the box up"),
  step("down", ["ArrowDown"], "Move the box down"),
  step("narrower", ["KeyA"], "Narrower"),
  step("wider", ["KeyS"], "Wider"),
  step("lower", ["KeyX"], "Lower"),
  step("higher", ["KeyC"], "Higher"),
  { id: "missed.next", codes: ["KeyJ"], meaning: "Next box" },
  { id: "missed.previous", codes: ["KeyK"], meaning: "Previous box" },
  { id: "missed.delete", codes: ["Delete", "Backspace"], meaning: "Delete the chosen box" },
  { id: "missed.done", codes: ["Escape", "Enter", "NumpadEnter", "KeyM"], meaning: "Back to the review" },
];

/** What a command does to a box, in steps: sideways, downwards, wider, higher. */
export const BOX_STEPS: ReadonlyMap<string, readonly [number, number, number, number]> = new Map([
  ["missed.left", [-1, 0, 0, 0]],
  ["missed.right", [1, 0, 0, 0]],
  ["missed.up", [0, -1, 0, 0]],
  ["missed.down", [0, 1, 0, 0]],
  ["missed.narrower", [0, 0, -1, 0]],
  ["missed.wider", [0, 0, 1, 0]],
  ["missed.lower", [0, 0, 0, -1]],
  ["missed.higher", [0, 0, 0, 1]],
]);
