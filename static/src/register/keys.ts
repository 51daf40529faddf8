/** The keyboard of the editor: muted while typing and in dialogs, arrows for the selected point. */
import { isTyping } from "../review/keymap";
import { ViewKeys } from "../viewer/gestures/view-keys";
import type { Editor } from "./editor";
import type { ImagePane } from "./image/image-pane";
import { actionOf, nudgeOf, type Action } from "./keymap";

/** Where arrows scroll or belong to a control of its own. */
const OWN_ARROWS = "[data-part=map], [data-part=table-scroll], .side-panel, [role=tab], [role=separator]";
const REPEATING: readonly Action["kind"][] = ["undo", "redo", "step", "image"];
/** Presses in a row are one edit to undo, until the hand rests. */
const REST_MS = 900;

export class RegisterKeys {
  private readonly viewKeys: ViewKeys;
  private stroke = 0;
  private lastNudge = 0;

  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
    private readonly pane: ImagePane,
    private readonly act: (action: Action) => void,
  ) {
    this.viewKeys = new ViewKeys(pane.viewer);
    document.addEventListener("keydown", this.onDown);
  }

  private readonly onDown = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || document.querySelector("dialog[open]") !== null) {
      return;
    }
    const target = event.target instanceof HTMLElement || event.target instanceof SVGElement ? event.target : document.body;
    if (target instanceof HTMLElement && isTyping(target)) {
      if (event.key === "Escape") {
        target.blur();
      }
      return;
    }
    if (this.onViewer(event, target) || this.onAction(event)) {
      event.preventDefault();
    }
  };

  private onViewer(event: KeyboardEvent, target: Element): boolean {
    if (target.closest(OWN_ARROWS) !== null && event.key.startsWith("Arrow")) {
      return false;
    }
    const nudge = nudgeOf(event);
    const { selected } = this.editor;
    const pixel = selected?.pixel ?? null;
    if (nudge !== null && selected !== null && pixel !== null) {
      if (event.timeStamp - this.lastNudge > REST_MS) {
        this.stroke += 1;
      }
      this.lastNudge = event.timeStamp;
      const [u, v] = pixel;
      this.editor.movePixel(selected.key, [u + nudge[0], v + nudge[1]], `nudge-${this.stroke}`);
      return true;
    }
    if (event.key === "Enter" && target === this.pane.viewer.surface) {
      this.pane.placeInMiddle();
      return true;
    }
    const isChord = event.ctrlKey || event.altKey || event.metaKey;
    return !isChord && this.root.contains(target) && this.viewKeys.handle(event);
  }

  private onAction(event: KeyboardEvent): boolean {
    const action = actionOf(event);
    if (action === null || (event.repeat && !REPEATING.includes(action.kind))) {
      return false;
    }
    this.act(action);
    return true;
  }
}
