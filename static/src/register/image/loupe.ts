/**
 * A magnifier at the pointer: the photograph's own pixels as squares, with a crosshair at the exact
 * sub-pixel place. While a point is dragged it shows the point and not the finger.
 */
import type { Pixel } from "../../geometry/camera";
import type { Size } from "../../viewer/view";

/** Screen pixels per pixel of the photograph. */
const MAGNIFIED = 10;
const SIDE_PX = 170;
const GAP_PX = 26;
/** A view closer than this shows single pixels by itself. */
const NEEDED_BELOW_SCALE = 7;

export class Loupe {
  isOn = true;
  private source: HTMLImageElement | null = null;
  private readonly box = document.createElement("div");
  private readonly canvas = document.createElement("canvas");
  private readonly caption = document.createElement("span");

  constructor(surface: HTMLElement) {
    this.box.className = "loupe";
    this.box.setAttribute("aria-hidden", "true");
    this.box.hidden = true;
    this.box.append(this.canvas, this.caption);
    surface.append(this.box);
  }

  setSource(source: HTMLImageElement | null): void {
    this.source = source;
    this.hide();
  }

  hide(): void {
    this.box.hidden = true;
  }

  /** Shows the pixels around a place of the photograph, beside a place on the screen. */
  show(pixel: Pixel, at: readonly [x: number, y: number], viewScale: number, screen: Size): void {
    if (!this.isOn || this.source === null || viewScale >= NEEDED_BELOW_SCALE) {
      this.hide();
      return;
    }
    this.box.hidden = false;
    const roomRight = screen.width - at[0] > SIDE_PX + GAP_PX + 8;
    const roomAbove = at[1] > SIDE_PX + GAP_PX + 24;
    this.box.style.left = `${at[0] + (roomRight ? GAP_PX : -GAP_PX - SIDE_PX)}px`;
    this.box.style.top = `${at[1] + (roomAbove ? -GAP_PX - SIDE_PX : GAP_PX)}px`;
    this.caption.textContent = `u ${pixel[0].toFixed(2)}  v ${pixel[1].toFixed(2)}`;
    this.paint(this.source, pixel);
  }

  private paint(source: HTMLImageElement, [u, v]: Pixel): void {
    const ratio = window.devicePixelRatio;
    const side = Math.round(SIDE_PX * ratio);
    if (this.canvas.width !== side) {
      this.canvas.width = this.canvas.height = side;
    }
    const context = this.canvas.getContext("2d");
    if (context === null) {
      return;
    }
    const magnified = MAGNIFIED * ratio;
    context.imageSmoothingEnabled = false;
    context.fillStyle = "#0a0d11";
    context.fillRect(0, 0, side, side);
    // Corner coordinates: the centre of the first pixel lies half a pixel from its corner.
    const [left, top] = [u + 0.5 - side / magnified / 2, v + 0.5 - side / magnified / 2];
    const [column, row] = [Math.floor(left), Math.floor(top)];
    const count = Math.ceil(side / magnified) + 1;
    const [x, y] = [(column - left) * magnified, (row - top) * magnified];
    context.drawImage(source, column, row, count, count, x, y, count * magnified, count * magnified);
    this.crosshair(context, side, magnified);
  }

  private crosshair(context: CanvasRenderingContext2D, side: number, magnified: number): void {
    const [middle, gap] = [side / 2, magnified / 2];
    for (const [style, width] of [
      ["rgb(0 0 0 / 0.7)", 3],
      ["#ffffff", 1],
    ] as const) {
      context.strokeStyle = style;
      context.lineWidth = width * window.devicePixelRatio;
      context.beginPath();
      for (const sign of [-1, 1]) {
        context.moveTo(middle + sign * gap, middle);
        context.lineTo(middle + sign * (middle - 6), middle);
        context.moveTo(middle, middle + sign * gap);
        context.lineTo(middle, middle + sign * (middle - 6));
      }
      context.stroke();
    }
  }
}
