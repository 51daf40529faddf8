/** The keys of edit mode. The left hand turns and sizes, the right hand moves. */
import type { Command } from "../modes";

const step = (id: string, code: string, meaning: string): Command => ({
  id: `edit.${id}`,
  codes: [code],
  shift: "fine",
  repeats: true,
  meaning,
});

export const EDIT_COMMANDS: readonly Command[] = [
  step("move-left", "ArrowLeft", "Move to the left on the water, 1 m; with Shift 0.1 m"),
  step("move-right", "ArrowRight", "Move to the right on the water"),
  step("move-away", "ArrowUp", "Move away from the camera"),
  step("move-nearer", "ArrowDown", "Move nearer to the camera"),
  step("turn-left", "KeyQ", "Turn to port, 1 degree; with Shift 0.1 degree"),
  step("turn-right", "KeyW", "Turn to starboard"),
  { id: "edit.flip", codes: ["KeyF"], meaning: "Flip bow and stern" },
  step("shorter", "KeyA", "Shorter, 1 m; with Shift 0.1 m"),
  step("longer", "KeyS", "Longer"),
  step("narrower", "KeyD", "Narrower"),
  step("wider", "KeyG", "Wider"),
  step("lower", "KeyX", "Lower"),
  step("higher", "KeyC", "Higher"),
  { id: "edit.save", codes: ["Enter", "NumpadEnter"], meaning: "Save the corrected box" },
  { id: "edit.cancel", codes: ["Escape"], meaning: "Leave without saving" },
];
