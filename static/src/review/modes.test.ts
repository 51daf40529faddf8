import { describe, expect, it } from "vitest";

import { ModeMachine, type Mode, type ModeName } from "./modes";

function aMode(name: ModeName, said: string[], willing = true): Mode {
  return {
    name,
    title: name,
    hint: "",
    commands: [],
    enter: () => {
      said.push(`enter ${name}`);
      return willing;
    },
    leave: () => said.push(`leave ${name}`),
    act: () => undefined,
  };
}

describe("modes", () => {
  it("hold one at a time: another begins only after the one before was left", () => {
    const said: string[] = [];
    const machine = new ModeMachine(aMode("review", said));
    machine.add(aMode("missed", said));
    machine.add(aMode("edit", said));
    machine.onChange((mode) => said.push(`now ${mode.name}`));
    machine.enter("edit");
    machine.enter("missed");
    expect(machine.current.name).toBe("missed");
    machine.leave();
    expect(said).toEqual([
      "enter edit",
      "now edit",
      "leave edit",
      "now review",
      "enter missed",
      "now missed",
      "leave missed",
      "now review",
    ]);
  });

  it("stay as they are when one refuses", () => {
    const machine = new ModeMachine(aMode("review", []));
    machine.add(aMode("edit", [], false));
    expect(machine.enter("edit")).toBe(false);
    expect(machine.enter("rematch")).toBe(false);
    expect(machine.current.name).toBe("review");
  });

  it("stand in one order, whenever they were added", () => {
    const machine = new ModeMachine(aMode("review", []));
    machine.add(aMode("missed", []));
    machine.add(aMode("edit", []));
    expect(machine.all.map(({ name }) => name)).toEqual(["review", "edit", "missed"]);
  });
});
