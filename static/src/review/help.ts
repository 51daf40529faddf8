/**
 * The help: every command of every mode with its keys, from the same tables that the keyboard
 * reads, and the place to put a command on another key.
 */
import { element, part } from "../page/parts";
import { keyNames, type Keymap } from "./keymap";
import type { Command, Mode, ModeMachine } from "./modes";

const MODE_TITLES: Readonly<Record<Mode["name"], string>> = {
  review: "Review",
  reasons: "Reasons, right after a grade",
  edit: "Correcting a box",
  rematch: "Matching with another vessel",
  missed: "Marking a missed vessel",
};

export class Help {
  private readonly dialog: HTMLDialogElement;
  private waitingFor: Command | null = null;

  constructor(
    root: ParentNode,
    private readonly machine: ModeMachine,
    private readonly keymap: Keymap,
    private readonly onBindings: (bindings: Record<string, readonly string[]>) => void,
  ) {
    this.dialog = part(root, "help") as HTMLDialogElement;
    part(this.dialog, "reset-keys").addEventListener("click", () => {
      this.waitingFor = null;
      this.onBindings({});
    });
    this.dialog.addEventListener("keydown", this.onKey);
    this.dialog.addEventListener("close", () => {
      this.waitingFor = null;
    });
    keymap.onChange(() => {
      if (this.dialog.open) {
        this.show();
      }
    });
  }

  open(): void {
    this.show();
    this.dialog.showModal();
  }

  private show(message = ""): void {
    const tables = part(this.dialog, "keys");
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement : null;
    const focusedId = focused?.dataset["command"];
    tables.replaceChildren(...this.machine.all.map((mode) => this.table(mode)));
    part(this.dialog, "keys-message").textContent = message;
    part(this.dialog, "reset-keys").hidden = Object.keys(this.keymap.bindings).length === 0;
    if (focusedId !== undefined) {
      tables.querySelector<HTMLElement>(`[data-command="${focusedId}"]`)?.focus();
    }
  }

  private table(mode: Mode): HTMLElement {
    const section = element("section", "keys");
    section.append(element("h4", "", MODE_TITLES[mode.name]));
    section.append(...mode.commands.map((command) => this.row(command)));
    return section;
  }

  private row(command: Command): HTMLElement {
    const row = element("p", "keys__row");
    const isAwaited = command === this.waitingFor;
    const button = element("button", "keys__keys");
    button.type = "button";
    button.dataset["command"] = command.id;
    button.title = "Put on another key";
    if (isAwaited) {
      button.append(element("span", "keys__awaited", "Press a key"));
    } else {
      button.append(...keyNames(this.keymap, command).map((name) => element("kbd", "kbd", name)));
    }
    button.append(element("span", "visually-hidden", `: ${command.meaning}, change the key`));
    button.addEventListener("click", () => {
      this.waitingFor = command;
      this.show("Press the new key, or Esc to keep the old one.");
    });
    row.append(button, element("span", "", command.meaning));
    return row;
  }

  private readonly onKey = (event: KeyboardEvent): void => {
    const command = this.waitingFor;
    if (command === null || event.ctrlKey || event.altKey || event.metaKey || isModifier(event)) {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
    if (event.code === "Escape") {
      this.waitingFor = null;
      this.show();
      return;
    }
    const conflict = this.keymap.conflict(this.machine.all, command, event.code);
    if (conflict !== null) {
      this.show(`${conflict} Press another key, or Esc to keep the old one.`);
      return;
    }
    this.waitingFor = null;
    this.onBindings({ ...this.keymap.bindings, [command.id]: [event.code] });
    this.show();
  };
}

function isModifier({ key }: KeyboardEvent): boolean {
  return ["Shift", "Control", "Alt", "Meta", "AltGraph", "CapsLock", "Tab"].includes(key);
}
