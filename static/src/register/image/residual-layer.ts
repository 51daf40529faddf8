/**
 * Where the fit puts each keypoint: an arrow from the click to its projection, enlarged so that
 * two pixels are seen on a photograph of five million.
 */
import { toScreen, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import type { Editor } from "../editor";
import { svgElement } from "./svg";

export const ARROW_SCALES = [0, 1, 10, 50] as const;
export type ArrowScale = (typeof ARROW_SCALES)[number];

const HEAD_PX = 7;

export class ResidualLayer implements Overlay {
  scale: ArrowScale = 10;
  private readonly casing = svgElement("path", "overlay-casing");
  private readonly line = svgElement("path", "overlay-line register-arrow");
  private readonly worst = svgElement("path", "overlay-line register-arrow is-outlier");

  constructor(private readonly editor: Editor) {}

  attach(group: SVGGElement): void {
    group.append(this.casing, this.line, this.worst);
  }

  draw(view: View): void {
    let [usual, outliers] = ["", ""];
    const { figures, points } = this.editor;
    for (const { key, pixel, role } of this.scale === 0 ? [] : points) {
      const off = figures?.residualsPx.get(key);
      if (pixel === null || off === undefined || role === "off") {
        continue;
      }
      const [x, y] = toScreen(view, pixel);
      // In pixels of the image: zooming in enlarges an arrow together with its photograph.
      const arrow = arrowPath(x, y, off[0] * this.scale * view.scale, off[1] * this.scale * view.scale);
      if (figures?.outliers.has(key) === true) {
        outliers += arrow;
      } else {
        usual += arrow;
      }
    }
    this.casing.setAttribute("d", usual + outliers);
    this.line.setAttribute("d", usual);
    this.worst.setAttribute("d", outliers);
  }
}

function arrowPath(x: number, y: number, dx: number, dy: number): string {
  const length = Math.hypot(dx, dy);
  if (!(length > 1) || length > 20_000) {
    return "";
  }
  const head = Math.min(HEAD_PX, length / 2);
  const [ex, ey] = [(dx / length) * head, (dy / length) * head];
  const [tx, ty] = [x + dx, y + dy];
  const wing = (side: number): string =>
    `${(tx - ex - side * ey * 0.5).toFixed(1)} ${(ty - ey + side * ex * 0.5).toFixed(1)}`;
  return `M${x.toFixed(1)} ${y.toFixed(1)}L${tx.toFixed(1)} ${ty.toFixed(1)}M${wing(1)}L${tx.toFixed(1)} ${ty.toFixed(1)}L${wing(-1)}`;
}
