/**
 * The keyboard's way to look around: + and - zoom, 0 frames the object again, arrows pan. A mode
 * that claims the arrows (editing, say) says so, and then they are left to it.
 */
import type { ViewControl } from "../viewer";

const PAN_PX = 80;
const ARROWS: ReadonlyMap<string, readonly [number, number]> = new Map([
  ["ArrowLeft", [PAN_PX, 0]],
  ["ArrowRight", [-PAN_PX, 0]],
  ["ArrowUp", [0, PAN_PX]],
  ["ArrowDown", [0, -PAN_PX]],
]);

export class ViewKeys {
  constructor(
    private readonly control: ViewControl,
    private readonly arrowsAreClaimed: () => boolean = () => false,
  ) {}

  /** Handles a key that reached the page; true when it was one of these. */
  handle(event: { key: string }): boolean {
    const arrow = ARROWS.get(event.key);
    if (arrow !== undefined && !this.arrowsAreClaimed()) {
      this.control.pan(arrow[0], arrow[1]);
      return true;
    }
    // By character and not by position: people look for the + that is printed on their keyboard.
    switch (event.key) {
      case "+":
      case "=":
        this.control.zoomStep(1);
        return true;
      case "-":
      case "_":
        this.control.zoomStep(-1);
        return true;
      case "0":
        this.control.resetFraming();
        return true;
      default:
        return false;
    }
  }
}
