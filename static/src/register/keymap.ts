/**
 * Which key does what in the registration editor. Letters and digits go by their place on a US
 * keyboard (event.code); Ctrl+Z and its like are kept, because every hand knows them.
 */
import type { KeyPress } from "../review/keymap";
import type { Role } from "./model/point";

export type Action =
  | { readonly kind: "role"; readonly role: Role }
  | { readonly kind: "step"; readonly by: 1 | -1 }
  | { readonly kind: "image"; readonly by: 1 | -1 }
  | {
      readonly kind:
        | "next-worst"
        | "undo"
        | "redo"
        | "save"
        | "register"
        | "remove"
        | "adopt"
        | "landmarks"
        | "type-place"
        | "arrows"
        | "layers"
        | "loupe"
        | "fit"
        | "map"
        | "import"
        | "leave"
        | "help";
    };

const ACTIONS: ReadonlyMap<string, Action> = new Map<string, Action>([
  ["KeyN", { kind: "next-worst" }],
  ["KeyJ", { kind: "step", by: 1 }],
  ["KeyK", { kind: "step", by: -1 }],
  ["KeyL", { kind: "image", by: 1 }],
  ["KeyH", { kind: "image", by: -1 }],
  ["Digit1", { kind: "role", role: "control" }],
  ["Digit2", { kind: "role", role: "check" }],
  ["Digit3", { kind: "role", role: "off" }],
  ["KeyU", { kind: "undo" }],
  ["KeyS", { kind: "save" }],
  ["KeyR", { kind: "register" }],
  ["Delete", { kind: "remove" }],
  ["Backspace", { kind: "remove" }],
  ["KeyA", { kind: "adopt" }],
  ["KeyG", { kind: "landmarks" }],
  ["KeyC", { kind: "type-place" }],
  ["KeyE", { kind: "arrows" }],
  ["KeyV", { kind: "layers" }],
  ["KeyO", { kind: "loupe" }],
  ["KeyZ", { kind: "fit" }],
  ["KeyM", { kind: "map" }],
  ["KeyI", { kind: "import" }],
  ["Escape", { kind: "leave" }],
]);

/** The action of a key press; null leaves the key to the browser. */
export function actionOf(press: KeyPress): Action | null {
  if (press.ctrlKey || press.metaKey) {
    const isUndo = press.code === "KeyZ" && !press.altKey;
    const isRedo = (isUndo && press.shiftKey) || (press.code === "KeyY" && !press.shiftKey && !press.altKey);
    return isRedo ? { kind: "redo" } : isUndo ? { kind: "undo" } : null;
  }
  if (press.altKey) {
    return null;
  }
  if (press.key === "?") {
    return { kind: "help" };
  }
  if (press.shiftKey) {
    return press.code === "KeyU" ? { kind: "redo" } : null;
  }
  return ACTIONS.get(press.code) ?? null;
}

const ARROWS: ReadonlyMap<string, readonly [number, number]> = new Map([
  ["ArrowLeft", [-1, 0]],
  ["ArrowRight", [1, 0]],
  ["ArrowUp", [0, -1]],
  ["ArrowDown", [0, 1]],
]);
const FINE_PX = 0.1;

/** How far an arrow moves a point, px: one, with Shift a tenth; null for other keys. */
export function nudgeOf(press: KeyPress): readonly [number, number] | null {
  const arrow = ARROWS.get(press.key);
  if (arrow === undefined || press.ctrlKey || press.altKey || press.metaKey) {
    return null;
  }
  const step = press.shiftKey ? FINE_PX : 1;
  return [arrow[0] * step, arrow[1] * step];
}
