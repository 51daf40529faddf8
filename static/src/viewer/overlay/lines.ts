/**
 * Lines over a photograph: each is drawn twice, a dark casing under its colour, to be seen on any
 * picture, and redrawn in screen pixels whenever the view changes.
 */
import { toScreen, type Point, type View } from "../view";

const SVG = "http://www.w3.org/2000/svg";

export type Painter = (view: View) => string;

export class Lines {
  private readonly drawings: ((view: View) => void)[] = [];

  constructor(private readonly root: SVGGElement) {}

  clear(): void {
    this.drawings.length = 0;
    this.root.replaceChildren();
  }

  /** A group to draw into; what is drawn later lies on top. */
  group(className: string): SVGGElement {
    const group = document.createElementNS(SVG, "g");
    group.setAttribute("class", className);
    this.root.append(group);
    return group;
  }

  /** A line of the path data that `paint` gives; `className` says which layer it belongs to. */
  add(group: SVGGElement, className: string, paint: Painter): void {
    const paths = ["casing", "line"].map((role) => {
      const path = document.createElementNS(SVG, "path");
      path.setAttribute("class", `overlay-${role} ${className}`.trim());
      group.append(path);
      return path;
    });
    this.drawings.push((view) => {
      const d = paint(view);
      for (const path of paths) {
        path.setAttribute("d", d);
      }
    });
  }

  /** Words above a point. */
  label(group: SVGGElement, className: string, words: string, at: Point): void {
    if (!Number.isFinite(at[0]) || !Number.isFinite(at[1])) {
      return;
    }
    const text = document.createElementNS(SVG, "text");
    text.setAttribute("class", `overlay-label ${className}`.trim());
    text.textContent = words;
    group.append(text);
    this.drawings.push((view) => {
      const [x, y] = toScreen(view, at);
      text.setAttribute("x", x.toFixed(1));
      text.setAttribute("y", (y - 8).toFixed(1));
    });
  }

  draw(view: View): void {
    for (const drawing of this.drawings) {
      drawing(view);
    }
  }
}
