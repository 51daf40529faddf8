/** Landmarks and horizon of one pose, drawn over a photograph in screen pixels. */
import type { Overlay } from "../viewer/viewer";
import { toScreen, type Point, type View } from "../viewer/view";

const SVG = "http://www.w3.org/2000/svg";
const CROSS_PX = 7;

export interface DrawnPose {
  readonly landmarks: readonly { readonly name: string; readonly u_px: number; readonly v_px: number }[];
  readonly horizon: readonly Point[];
}

export class FlickOverlay implements Overlay {
  private group: SVGGElement | null = null;
  private pose: DrawnPose = { landmarks: [], horizon: [] };
  private view: View | null = null;

  attach(group: SVGGElement): void {
    this.group = group;
    group.classList.add("flick__marks");
  }

  /** Draws another pose; the name of its look goes into a class. */
  show(pose: DrawnPose, look: string): void {
    this.pose = pose;
    if (this.group !== null) {
      this.group.dataset["look"] = look;
    }
    if (this.view !== null) {
      this.draw(this.view);
    }
  }

  draw(view: View): void {
    this.view = view;
    this.group?.replaceChildren(...this.horizon(view), ...this.landmarks(view));
  }

  private horizon(view: View): SVGElement[] {
    if (this.pose.horizon.length < 2) {
      return [];
    }
    const points = this.pose.horizon.map((point) => at(view, point).join(" "));
    return lines(`M${points.join("L")}`, "flick__horizon");
  }

  private landmarks(view: View): SVGElement[] {
    return this.pose.landmarks.flatMap(({ name, u_px, v_px }) => {
      const [x, y] = at(view, [u_px, v_px]);
      const label = document.createElementNS(SVG, "text");
      label.setAttribute("class", "overlay-label flick__name");
      label.setAttribute("x", String(x + CROSS_PX + 4));
      label.setAttribute("y", String(y - CROSS_PX));
      label.textContent = name;
      const cross =
        `M${x - CROSS_PX} ${y}H${x + CROSS_PX}` + `M${x} ${y - CROSS_PX}V${y + CROSS_PX}`;
      return [...lines(cross, "flick__landmark"), label];
    });
  }
}

function lines(path: string, look: string): SVGElement[] {
  return ["overlay-casing", "overlay-line"].map((kind) => {
    const line = document.createElementNS(SVG, "path");
    line.setAttribute("class", `${kind} ${look}`);
    line.setAttribute("d", path);
    return line;
  });
}

function at(view: View, point: Point): Point {
  const [x, y] = toScreen(view, point);
  return [Math.round(x * 100) / 100, Math.round(y * 100) / 100];
}
