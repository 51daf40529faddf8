import { describe, expect, it } from "vitest";
import type { KeyPress } from "../review/keymap";
import { actionOf, nudgeOf } from "./keymap";

function press(code: string, changes: Partial<KeyPress> = {}): KeyPress {
  return { code, key: "", ctrlKey: false, altKey: false, metaKey: false, shiftKey: false, ...changes };
}

describe("keys of the registration editor", () => {
  it("undo and redo by single keys and by the usual chords", () => {
    expect(actionOf(press("KeyU"))).toEqual({ kind: "undo" });
    expect(actionOf(press("KeyU", { shiftKey: true }))).toEqual({ kind: "redo" });
    expect(actionOf(press("KeyZ", { ctrlKey: true }))).toEqual({ kind: "undo" });
    expect(actionOf(press("KeyZ", { ctrlKey: true, shiftKey: true }))).toEqual({ kind: "redo" });
    expect(actionOf(press("KeyY", { ctrlKey: true }))).toEqual({ kind: "redo" });
  });

  it("leaves other chords to the browser", () => {
    expect(actionOf(press("KeyS", { ctrlKey: true }))).toBeNull();
    expect(actionOf(press("KeyN", { altKey: true }))).toBeNull();
  });

  it("moves a point by a pixel, with Shift by a tenth", () => {
    expect(nudgeOf(press("ArrowLeft", { key: "ArrowLeft" }))).toEqual([-1, 0]);
    expect(nudgeOf(press("ArrowDown", { key: "ArrowDown", shiftKey: true }))).toEqual([0, 0.1]);
    expect(nudgeOf(press("KeyA", { key: "a" }))).toBeNull();
  });
});
