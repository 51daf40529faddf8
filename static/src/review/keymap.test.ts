import { describe, expect, it } from "vitest";
import { REASON_COMMANDS, REVIEW_COMMANDS } from "./commands";
import { isTyping, keyName, keyNames, Keymap, type KeyPress } from "./keymap";
import type { Command, Mode } from "./modes";

function press(code: string, changes: Partial<KeyPress> = {}): KeyPress {
  return { code, key: "", ctrlKey: false, altKey: false, metaKey: false, shiftKey: false, ...changes };
}

function mode(name: Mode["name"], commands: readonly Command[]): Mode {
  const nothing = (): void => undefined;
  return { name, title: "", hint: "", commands, enter: () => true, leave: nothing, act: nothing };
}

function command(id: string): Command {
  const found = REVIEW_COMMANDS.find((one) => one.id === id);
  if (found === undefined) {
    throw new Error(`No such command: ${id}`);
  }
  return found;
}

const MODES = [
  mode("review", REVIEW_COMMANDS),
  mode("reasons", REASON_COMMANDS),
  mode("edit", [{ id: "edit.save", codes: ["Enter"], meaning: "Save" }]),
];

describe("the review keys", () => {
  const idOf = (keymap: Keymap, key: KeyPress): string | null =>
    keymap.commandOf(REVIEW_COMMANDS, key)?.id ?? null;

  it.each([
    ["Digit1", "review.good"],
    ["Digit2", "review.ok"],
    ["Digit3", "review.bad"],
    ["Numpad4", "review.wrong"],
    ["Backspace", "review.undo"],
    ["Enter", "review.complete"],
  ])("%s is %s", (code, id) => {
    expect(idOf(new Keymap(), press(code))).toBe(id);
  });

  it("go by place, whatever the layout prints there", () => {
    expect(idOf(new Keymap(), press("Digit1", { key: "&" }))).toBe("review.good");
    expect(idOf(new Keymap(), press("KeyZ", { key: "y" }))).toBe("review.fit");
  });

  it("leave chords, Tab and Escape to the browser", () => {
    for (const chord of [{ ctrlKey: true }, { altKey: true }, { metaKey: true }]) {
      expect(idOf(new Keymap(), press("Digit1", chord))).toBeNull();
    }
    expect(["Tab", "Escape"].map((code) => idOf(new Keymap(), press(code)))).toEqual([null, null]);
  });

  it("tell Shift and 1 from 1", () => {
    expect(idOf(new Keymap(), press("Digit1", { shiftKey: true }))).toBe("review.rest-good");
    expect(idOf(new Keymap(), press("Digit2", { shiftKey: true }))).toBeNull();
  });

  it("can be put elsewhere, and then the old place is free", () => {
    const keymap = new Keymap({ "review.good": ["KeyO"] });
    expect([idOf(keymap, press("KeyO")), idOf(keymap, press("Digit1"))]).toEqual([
      "review.good",
      null,
    ]);
  });

  it("stand on different keys from the start", () => {
    const keymap = new Keymap();
    const conflicts = MODES.flatMap(({ commands }) => commands).flatMap((one) =>
      keymap.codesOf(one).map((code) => keymap.conflict(MODES, one, code)),
    );
    expect(conflicts.filter((conflict) => conflict !== null)).toEqual([]);
  });

  it("refuse a place that is taken, by name, in the same mode only", () => {
    const keymap = new Keymap();
    expect(keymap.conflict(MODES, command("review.good"), "KeyJ")).toBe("J is the key of “Next box”.");
    expect(keymap.conflict(MODES, command("review.good"), "KeyQ")).toContain("Reason 1");
    expect(keymap.conflict(MODES, command("review.good"), "Tab")).toContain("its own meaning");
    expect(keymap.conflict(MODES, command("review.rest-good"), "KeyJ")).toBeNull();
    expect(keymap.conflict(MODES, command("review.good"), "KeyO")).toBeNull();
    const [save] = MODES[2]?.commands ?? [];
    expect(save && keymap.conflict(MODES, save, "KeyJ")).toBeNull();
  });

  it("are named as they are printed on a US keyboard", () => {
    const names = ["KeyQ", "Digit1", "Numpad1", "ArrowLeft", "Space"].map(keyName);
    expect(names).toEqual(["Q", "1", "Num 1", "←", "Space"]);
    expect(keyNames(new Keymap(), command("review.good"))).toEqual(["1"]);
    expect(keyNames(new Keymap(), command("review.rest-good"))).toEqual(["⇧ 1"]);
  });
});

it("keys are muted while somebody types in a field in sight, not by a focused tick box or button", () => {
  const checkVisibility = (): boolean => true;
  const at = (tagName: string, type = ""): boolean =>
    isTyping({ tagName, type, isContentEditable: false, checkVisibility });
  expect([at("TEXTAREA"), at("INPUT", "text"), at("SELECT")]).toEqual([true, true, true]);
  expect([at("INPUT", "checkbox"), at("BUTTON"), at("DIV")]).toEqual([false, false, false]);
  expect(isTyping({ tagName: "DIV", isContentEditable: true, checkVisibility })).toBe(true);
  const gone = { tagName: "TEXTAREA", isContentEditable: false, checkVisibility: (): boolean => false };
  expect(isTyping(gone)).toBe(false);
});
