/**
 * Where the fit shows the site's landmarks: green rings for those that are placed here, grey
 * diamonds for the others. A projected landmark never enters the fit by itself; a click on it (or a
 * key) takes it as a draft.
 */
import { isInImage, project, type Pixel } from "../../geometry/camera";
import { toScreen, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import type { Editor } from "../editor";
import type { Landmark } from "../model/point";
import { PROJECTED, type NamedMark } from "./name-layout";
import { svgElement } from "./svg";

export interface Projected {
  readonly landmark: Landmark;
  readonly pixel: Pixel;
}

export class ProjectionLayer implements Overlay {
  readonly hasControls = true;
  isShown = true;
  private shown: readonly Projected[] = [];
  private group: SVGGElement | null = null;
  private readonly placed = svgElement("path", "register-projected is-placed");
  private readonly placedCasing = svgElement("path", "register-projected__casing");
  private readonly others = new Map<number, SVGGElement>();

  constructor(
    private readonly editor: Editor,
    private readonly onAdopt: (projected: Projected) => void,
  ) {}

  attach(group: SVGGElement): void {
    this.group = group;
    group.append(this.placedCasing, this.placed);
  }

  /** The landmarks of the site that the fit sees in the image and that nobody has placed. */
  candidates(): Projected[] {
    const camera = this.editor.figures?.camera;
    if (camera === undefined) {
      return [];
    }
    const taken = new Set(this.editor.points.map(({ landmarkId }) => landmarkId));
    return this.editor.landmarks
      .filter(({ id }) => !taken.has(id))
      .flatMap((landmark) => {
        const pixel = project(camera, this.editor.world.frame.position(landmark.place));
        return pixel !== null && isInImage(camera.intrinsics, pixel) ? [{ landmark, pixel }] : [];
      });
  }

  names(view: View): NamedMark[] {
    return this.shown.flatMap(({ landmark, pixel }) => {
      const group = this.others.get(landmark.id);
      const label = group?.querySelector("text") ?? null;
      const [x, y] = toScreen(view, pixel);
      return group === undefined || label === null
        ? []
        : [{ group, label, name: landmark.name, x, y, gap: 12, rank: PROJECTED }];
    });
  }

  draw(view: View): void {
    const { figures, points } = this.editor;
    let rings = "";
    for (const { key, pixel } of this.isShown && figures !== null ? points : []) {
      const off = figures?.residualsPx.get(key);
      if (pixel !== null && off !== undefined) {
        const [x, y] = toScreen(view, [pixel[0] + off[0], pixel[1] + off[1]]);
        rings += `M${(x - 4).toFixed(1)} ${y.toFixed(1)}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0`;
      }
    }
    this.placed.setAttribute("d", rings);
    this.placedCasing.setAttribute("d", rings);
    this.shown = this.isShown ? this.candidates() : [];
    this.drawCandidates(this.shown, view);
  }

  private drawCandidates(candidates: readonly Projected[], view: View): void {
    for (const [id, mark] of this.others) {
      if (!candidates.some(({ landmark }) => landmark.id === id)) {
        mark.remove();
        this.others.delete(id);
      }
    }
    for (const candidate of candidates) {
      const mark = this.others.get(candidate.landmark.id) ?? this.make(candidate.landmark);
      const [x, y] = toScreen(view, candidate.pixel);
      mark.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    }
  }

  private make(landmark: Landmark): SVGGElement {
    const mark = svgElement("g", "register-candidate", {
      tabindex: this.editor.mayEdit ? 0 : -1,
      role: "button",
      "aria-label": `${landmark.name}: projected here; press to take it as a draft`,
    });
    const path = "M0 -7L7 0L0 7L-7 0Z";
    mark.append(
      svgElement("circle", "register-candidate__area", { r: 14 }),
      svgElement("path", "register-candidate__casing", { d: path }),
      svgElement("path", "register-candidate__shape", { d: path }),
      svgElement("text", "register-candidate__label", { y: 4.5 }),
    );
    const label = mark.querySelector("text");
    if (label !== null) {
      label.textContent = landmark.name;
    }
    const adopt = (): void => {
      const found = this.candidates().find((candidate) => candidate.landmark.id === landmark.id);
      if (found !== undefined) {
        this.onAdopt(found);
      }
    };
    mark.addEventListener("pointerdown", (event) => {
      event.stopPropagation(); // neither a pan nor a new keypoint
    });
    mark.addEventListener("click", adopt);
    mark.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === " ") {
        event.preventDefault();
        event.stopPropagation();
        adopt();
      }
    });
    this.group?.append(mark);
    this.others.set(landmark.id, mark);
    return mark;
  }
}
