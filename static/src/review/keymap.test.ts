import { describe, expect, it } from "vitest";
import { actionOf, isTyping, type KeyPress } from "./keymap";

function press(code: string, changes: Partial<KeyPress> = {}): KeyPress {
  return { code, key: "", ctrlKey: false, altKey: false, metaKey: false, shiftKey: false, ...changes };
}

describe("the review keys", () => {
  it.each([
    ["Digit1", "good"],
    ["Digit2", "ok"],
    ["Digit3", "bad"],
    ["Digit4", "wrong"],
    ["Numpad4", "wrong"],
  ])("%s grades %s", (code, grade) => {
    expect(actionOf(press(code))).toEqual({ kind: "grade", grade });
  });

  it("go by place, whatever the layout prints there", () => {
    expect(actionOf(press("Digit1", { key: "&" }))).toEqual({ kind: "grade", grade: "good" });
    expect(actionOf(press("KeyZ", { key: "y" }))).toEqual({ kind: "framing" });
  });

  it("leave chords to the browser", () => {
    for (const chord of [{ ctrlKey: true }, { altKey: true }, { metaKey: true }]) {
      expect(actionOf(press("Digit1", chord))).toBeNull();
    }
    expect(actionOf(press("Digit1", { shiftKey: true }))).toBeNull();
  });

  it("leave Tab, Enter and Escape to the browser", () => {
    expect(["Tab", "Enter", "Escape"].map((code) => actionOf(press(code)))).toEqual([
      null,
      null,
      null,
    ]);
  });

  it("find the question mark by its character", () => {
    expect(actionOf(press("Minus", { key: "?", shiftKey: true }))).toEqual({ kind: "help" });
  });

  it("are muted while somebody types, but not by a focused tick box or button", () => {
    const at = (tagName: string, type?: string): boolean =>
      isTyping({ tagName, isContentEditable: false, ...(type === undefined ? {} : { type }) });
    expect([at("TEXTAREA"), at("INPUT", "text"), at("SELECT")]).toEqual([true, true, true]);
    expect([at("INPUT", "checkbox"), at("BUTTON"), at("DIV")]).toEqual([false, false, false]);
    expect(isTyping({ tagName: "DIV", isContentEditable: true })).toBe(true);
  });
});
