/**
 * Which key does what while reviewing. Keys go by their place on the keyboard (event.code), so that
 * the hand finds them under any layout; keys with Ctrl, Alt or Meta belong to the browser, and keys
 * typed into a field to that field.
 */
import type { Grade } from "./pose";

export type Action =
  | { readonly kind: "grade"; readonly grade: Grade }
  | { readonly kind: "box"; readonly by: 1 | -1 }
  | { readonly kind: "image"; readonly by: 1 | -1 }
  | { readonly kind: "next-ungraded" | "back" | "peek" | "framing" | "layers" | "help" };

export interface KeyPress {
  readonly code: string;
  readonly key: string;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
}

const ACTIONS: ReadonlyMap<string, Action> = new Map<string, Action>([
  ["Digit1", { kind: "grade", grade: "good" }],
  ["Digit2", { kind: "grade", grade: "ok" }],
  ["Digit3", { kind: "grade", grade: "bad" }],
  ["Digit4", { kind: "grade", grade: "wrong" }],
  ["Numpad1", { kind: "grade", grade: "good" }],
  ["Numpad2", { kind: "grade", grade: "ok" }],
  ["Numpad3", { kind: "grade", grade: "bad" }],
  ["Numpad4", { kind: "grade", grade: "wrong" }],
  ["KeyJ", { kind: "box", by: 1 }],
  ["KeyK", { kind: "box", by: -1 }],
  ["KeyL", { kind: "image", by: 1 }],
  ["KeyH", { kind: "image", by: -1 }],
  ["KeyN", { kind: "next-ungraded" }],
  ["Backspace", { kind: "back" }],
  ["Space", { kind: "peek" }],
  ["KeyZ", { kind: "framing" }],
  ["KeyV", { kind: "layers" }],
]);

/** The action of a key press; null leaves the key to the browser. */
export function actionOf(press: KeyPress): Action | null {
  if (press.ctrlKey || press.altKey || press.metaKey) {
    return null;
  }
  if (press.key === "?") {
    return { kind: "help" }; // by character: its place differs too much between layouts
  }
  return press.shiftKey ? null : (ACTIONS.get(press.code) ?? null);
}

/** Whether a key press is meant for the element that has the focus. */
export function isTyping(target: { tagName: string; isContentEditable: boolean; type?: string }): boolean {
  const typed = ["INPUT", "TEXTAREA", "SELECT"].includes(target.tagName);
  const isTick = target.tagName === "INPUT" && ["checkbox", "radio"].includes(target.type ?? "");
  return target.isContentEditable || (typed && !isTick);
}
