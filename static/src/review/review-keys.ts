/** The keyboard: a key press becomes a command of the mode that holds, or moves the view. */
import type { ViewKeys } from "../viewer/gestures/view-keys";
import { isTyping, type Keymap } from "./keymap";
import type { Command, ModeMachine } from "./modes";

/** Where the arrows scroll instead of moving the view. */
const SCROLLING = "[data-part=panel]";
const PEEK = "review.peek";

export class ReviewKeys {
  private peekingWith = "";

  constructor(
    private readonly machine: ModeMachine,
    private readonly keymap: Keymap,
    private readonly viewKeys: ViewKeys,
    private readonly onPeek: (peeking: boolean) => void,
    private readonly onHelp: () => void,
  ) {
    document.addEventListener("keydown", this.onDown);
    document.addEventListener("keyup", ({ code }) => {
      if (code === this.peekingWith) {
        this.onPeek(false);
      }
    });
    window.addEventListener("blur", () => {
      this.onPeek(false);
    });
  }

  private readonly onDown = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || document.querySelector("dialog[open]") !== null) {
      return;
    }
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    if (isTyping(target) || pressesControl(event, target)) {
      return;
    }
    const isChord = event.ctrlKey || event.altKey || event.metaKey;
    if (event.key === "?" && !isChord) {
      // By character: its place differs too much between layouts.
      event.preventDefault();
      this.onHelp();
      return;
    }
    const command = this.commandOf(event);
    if (command === null) {
      const scrolls = target.closest(SCROLLING) !== null && event.key.startsWith("Arrow");
      if (!isChord && !scrolls && this.viewKeys.handle(event)) {
        event.preventDefault();
      }
      return;
    }
    event.preventDefault();
    if (command.id === PEEK) {
      this.peekingWith = event.code;
      this.onPeek(true);
    } else if (!event.repeat || command.repeats === true) {
      this.machine.current.act(command.id, { fine: event.shiftKey }); // held down, a key grades once
    }
  };

  private commandOf(event: KeyboardEvent): Command | null {
    const { current } = this.machine;
    const own = this.keymap.commandOf(current.commands, event);
    const usual = this.machine.usual;
    if (own !== null || current === usual) {
      return own;
    }
    const found = this.keymap.commandOf(usual.commands, event);
    if (current.fallsThrough !== true) {
      return found?.id === PEEK ? found : null;
    }
    if (!MODIFIERS.has(event.key)) {
      this.machine.leave();
    }
    return found;
  }
}

const MODIFIERS: ReadonlySet<string> = new Set(["Shift", "Control", "Alt", "Meta", "AltGraph"]);

/** Space and Enter press the control that has the focus. */
function pressesControl({ code }: KeyboardEvent, target: HTMLElement): boolean {
  const presses = code === "Space" || code === "Enter" || code === "NumpadEnter";
  return presses && target.closest("button, a, summary, input") !== null;
}
