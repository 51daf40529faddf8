/**
 * What the fit says of the water: the horizon, a grid of ranges and bearings, how sure a point on
 * the water is (in pixels), and where the next keypoint would help most. Drawn from the server's
 * answer; the horizon follows a drag by itself.
 */
import { horizonOf } from "../../geometry/horizon";
import type { Pixel } from "../../geometry/camera";
import { toScreen, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import type { HeatMap, Polyline } from "../api";
import type { Editor } from "../editor";
import { heatClass } from "./heat-scale";
import { svgElement } from "./svg";

export const WATER_PARTS = ["horizon", "grid", "heat", "next"] as const;
export type WaterPart = (typeof WATER_PARTS)[number];

export class WaterLayer implements Overlay {
  readonly shown = new Set<WaterPart>(["horizon", "grid", "next"]);
  private readonly heat = svgElement("g", "register-heat");
  private readonly gridCasing = svgElement("path", "overlay-casing register-grid__casing");
  private readonly grid = svgElement("path", "overlay-line register-grid");
  private readonly labels = svgElement("g", "register-grid__labels");
  private readonly horizonCasing = svgElement("path", "overlay-casing");
  private readonly horizon = svgElement("path", "overlay-line register-horizon");
  private readonly next = svgElement("g", "register-next");
  private heatDrawn: HeatMap | null = null;

  constructor(private readonly editor: Editor) {}

  attach(group: SVGGElement): void {
    group.append(
      this.heat,
      this.gridCasing,
      this.grid,
      this.labels,
      this.horizonCasing,
      this.horizon,
      this.next,
    );
  }

  draw(view: View): void {
    const { answer, figures } = this.editor;
    const isOn = (part: WaterPart): boolean => this.shown.has(part) && figures !== null;
    this.drawHeat(isOn("heat"), view);
    const lines = isOn("grid") ? (answer?.grid ?? []) : [];
    const grid = lines.map(({ lines: pieces }) => pathOf(pieces, view)).join("");
    this.grid.setAttribute("d", grid);
    this.gridCasing.setAttribute("d", grid);
    this.labels.replaceChildren(
      ...lines.flatMap(({ label, at_px }) => (at_px === null ? [] : [labelAt(label, at_px, view)])),
    );
    const horizon = isOn("horizon") ? pathOf(this.liveHorizon(), view) : "";
    this.horizon.setAttribute("d", horizon);
    this.horizonCasing.setAttribute("d", horizon);
    this.drawNext(view);
  }

  private liveHorizon(): readonly Polyline[] {
    const { figures, world } = this.editor;
    if (figures === null) {
      return [];
    }
    const { heightM } = world.frame.geodetic(figures.camera.center);
    return horizonOf(figures.camera, heightM - world.waterLevelM);
  }

  /** Cells stay where they are in the image; moving the view moves their group. */
  private drawHeat(isOn: boolean, view: View): void {
    const map = isOn ? (this.editor.answer?.heat_map ?? null) : null;
    if (map !== this.heatDrawn) {
      this.heatDrawn = map;
      this.heat.replaceChildren(...(map === null ? [] : cellsOf(map)));
    }
    this.heat.setAttribute("transform", `translate(${view.x} ${view.y}) scale(${view.scale})`);
  }

  private drawNext(view: View): void {
    const place = this.shown.has("next") ? this.editor.answer?.readiness.next_point : null;
    if (place === null || place === undefined || !this.editor.mayEdit) {
      this.next.replaceChildren();
      return;
    }
    const [u1, v1, u2, v2] = place.box_px;
    const [x, y] = toScreen(view, [u1, v1]);
    const [right, bottom] = toScreen(view, [u2, v2]);
    const frame = { x, y, width: right - x, height: bottom - y, rx: 6 };
    const text = svgElement("text", "register-next__label", { x: x + 8, y: y + 18 });
    text.textContent = "A keypoint here helps most";
    this.next.replaceChildren(
      svgElement("rect", "register-next__casing", frame),
      svgElement("rect", "register-next__box", frame),
      text,
    );
  }
}

function cellsOf(map: HeatMap): SVGRectElement[] {
  const [width, height] = map.cell_px;
  return map.sigma_px.flatMap((row, r) =>
    row.flatMap((sigma, c) => {
      const corner = { x: c * width, y: r * height };
      return sigma === null ? [] : [svgElement("rect", heatClass(sigma), { ...corner, width, height })];
    }),
  );
}

function pathOf(pieces: readonly Polyline[], view: View): string {
  return pieces
    .map((piece) =>
      piece
        .map((point, index) => {
          const [x, y] = toScreen(view, point);
          return `${index === 0 ? "M" : "L"}${x.toFixed(1)} ${y.toFixed(1)}`;
        })
        .join(""),
    )
    .join("");
}

function labelAt(label: string, at: Pixel, view: View): SVGTextElement {
  const [x, y] = toScreen(view, at);
  const text = svgElement("text", "register-grid__label", { x: x.toFixed(1), y: (y - 4).toFixed(1) });
  text.textContent = label;
  return text;
}
