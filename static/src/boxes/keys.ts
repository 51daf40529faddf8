/** Keys and buttons of the drawing screen: both lead to the same commands. */
import { element, part } from "../page/parts";
import { isTyping, keyNames, type Keymap } from "../review/keymap";
import type { ViewKeys } from "../viewer/gestures/view-keys";
import { BOX_COMMANDS, STEPS } from "./commands";

export class BoxKeys {
  private readonly help: HTMLDialogElement;

  constructor(
    root: HTMLElement,
    private readonly keymap: Keymap,
    private readonly viewKeys: ViewKeys,
    private readonly onCommand: (commandId: string, fine: boolean) => void,
  ) {
    this.help = part(document, "help") as HTMLDialogElement;
    root.addEventListener("click", ({ target }) => {
      const button = target instanceof Element ? target.closest<HTMLElement>("[data-command]") : null;
      const commandId = button?.dataset["command"];
      if (commandId === "boxes.help") {
        this.openHelp();
      } else if (commandId !== undefined) {
        this.onCommand(commandId, false);
      }
    });
    document.addEventListener("keydown", this.onDown);
  }

  private openHelp(): void {
    part(this.help, "keys").replaceChildren(
      ...BOX_COMMANDS.map((command) => {
        const row = element("p", "keys__row");
        const keys = element("span", "keys__keys");
        keys.append(...keyNames(this.keymap, command).map((name) => element("kbd", "kbd", name)));
        row.append(keys, element("span", "", command.meaning));
        return row;
      }),
    );
    this.help.showModal();
  }

  private readonly onDown = (event: KeyboardEvent): void => {
    const isBusy = event.defaultPrevented || document.querySelector("dialog[open]") !== null;
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    const isChord = event.ctrlKey || event.altKey || event.metaKey;
    if (isBusy || isChord || isTyping(target)) {
      return;
    }
    if (event.key === "?") {
      event.preventDefault();
      this.openHelp();
      return;
    }
    const presses = ["Space", "Enter", "NumpadEnter"].includes(event.code);
    if (presses && target.closest("button, a, summary, input") !== null) {
      return; // the control that has the focus
    }
    const command = this.keymap.commandOf(BOX_COMMANDS, event);
    // Arrows move the view while there is no box for them to move.
    const isStep = command !== null && STEPS.has(command.id) && event.key.startsWith("Arrow");
    if (command === null || isStep) {
      if (this.viewKeys.handle(event)) {
        event.preventDefault();
        return;
      }
    }
    if (command !== null && (!event.repeat || command.repeats === true)) {
      event.preventDefault();
      this.onCommand(command.id, event.shiftKey);
    }
  };
}
