/** The keyboard while reviewing: keys become actions, holding Space takes the drawings away. */
import type { ViewKeys } from "../viewer/gestures/view-keys";
import { actionOf, isTyping, type Action } from "./keymap";

/** Where the arrows scroll instead of moving the view. */
const SCROLLING = "[data-part=panel]";

export class ReviewKeys {
  constructor(
    private readonly viewKeys: ViewKeys,
    private readonly act: (action: Action) => void,
    private readonly onPeek: (peeking: boolean) => void,
  ) {
    document.addEventListener("keydown", this.onDown);
    document.addEventListener("keyup", this.onUp);
    window.addEventListener("blur", () => {
      this.onPeek(false);
    });
  }

  private readonly onDown = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || document.querySelector("dialog[open]") !== null) {
      return;
    }
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    if (isTyping(target)) {
      return;
    }
    const action = actionOf(event);
    if (action === null) {
      const scrolls = target.closest(SCROLLING) !== null && event.key.startsWith("Arrow");
      const isChord = event.ctrlKey || event.altKey || event.metaKey;
      if (!isChord && !scrolls && this.viewKeys.handle(event)) {
        event.preventDefault();
      }
      return;
    }
    if (action.kind === "peek" && target.closest("button, a, summary, input") !== null) {
      return; // Space presses the control that has the focus
    }
    event.preventDefault();
    if (action.kind === "peek") {
      this.onPeek(true);
    } else if (!event.repeat || action.kind === "box" || action.kind === "image") {
      this.act(action); // a key held down grades once
    }
  };

  private readonly onUp = (event: KeyboardEvent): void => {
    if (event.code === "Space") {
      this.onPeek(false);
    }
  };
}
