/**
 * What the fit says of the water: the horizon, a grid of ranges and bearings, how sure a point on
 * the water is (in pixels), and where the next keypoint would help most. Drawn from the server's
 * answer; the horizon follows a drag by itself.
 */
import { horizonOf } from "../../geometry/horizon";
import { toScreen, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import type { GridLine, HeatMap, Polyline } from "../api";
import type { Editor } from "../editor";
import { overlap, widthOf } from "../labels";
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
  /** Somebody asked where the next keypoint helps, though enough are there. */
  isAsked = false;
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
    this.labels.replaceChildren(...this.labelsOf(lines, view));
    const horizon = isOn("horizon") ? pathOf(this.liveHorizon(), view) : "";
    this.horizon.setAttribute("d", horizon);
    this.horizonCasing.setAttribute("d", horizon);
    this.drawNext(view);
  }

  /** Ranges end at their place and bearings stand over it; what would cover another is left out. */
  private labelsOf(lines: readonly GridLine[], view: View): SVGTextElement[] {
    const taken = this.editor.points.flatMap(({ pixel, name }) => {
      const [x, y] = toScreen(view, pixel ?? [Number.NaN, Number.NaN]);
      return { x1: x - 10, y1: y - 8, x2: x + 13 + widthOf(name), y2: y + 8 };
    });
    return lines.flatMap(({ kind, label, at_px: place }) => {
      if (place === null) {
        return [];
      }
      const [x, y] = toScreen(view, place);
      const width = widthOf(label);
      const [x1, y2] = [kind === "range" ? x - width - 4 : x - width / 2, y - 2];
      const box = { x1, y1: y2 - 15, x2: x1 + width, y2 };
      if (taken.some((other) => overlap(box, other))) {
        return [];
      }
      taken.push(box);
      const text = svgElement("text", "register-grid__label", { x: x1.toFixed(1), y: (y - 5).toFixed(1) });
      text.textContent = label;
      return [text];
    });
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
    const readiness = this.editor.answer?.readiness;
    // Where enough is there, it is shown to those who ask.
    const isWanted = this.shown.has("next") && (readiness?.level !== "good" || this.isAsked);
    // Before the first keypoint every place is as good as another.
    const isBegun = (readiness?.control_points ?? 0) > 0;
    const place = isWanted && isBegun ? readiness?.next_point : null;
    if (place === null || place === undefined || !this.editor.mayEdit) {
      this.next.replaceChildren();
      return;
    }
    const [u1, v1, u2, v2] = place.box_px;
    const [x, y] = toScreen(view, [u1, v1]);
    const [right, bottom] = toScreen(view, [u2, v2]);
    const frame = { x, y, width: right - x, height: bottom - y, rx: 6 };
    const text = svgElement("text", "register-next__label", { x: x + 8, y: bottom - 8 });
    text.textContent = "Next keypoint here";
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
