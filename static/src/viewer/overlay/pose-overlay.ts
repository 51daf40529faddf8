/**
 * Draws the poses of one image: the current one in full, the others dimmed to their outlines.
 *
 * Every line is drawn twice, a dark casing under the colour, to be seen on any photograph. Layers
 * differ in dash pattern as well as in colour.
 */
import type { Overlay } from "../viewer";
import type { Point, Rect, View } from "../view";
import { drawBox } from "./box";
import { arrowHead, polygonPath, rectPath, segmentsPath } from "./paths";

const SVG = "http://www.w3.org/2000/svg";
const ARROW_PX = 9;

export const LAYERS = ["detection", "reported", "dead_reckoned", "corrected", "box", "axes"] as const;
export type Layer = (typeof LAYERS)[number];

/** What is drawn of a pose; all points in geometry's pixels. */
export interface DrawnPose {
  readonly id: number;
  readonly detection: Rect;
  readonly corners: readonly Point[];
  readonly segments: Readonly<Record<"reported" | "dead_reckoned" | "corrected", readonly Point[]>>;
}

type Painter = (view: View) => string;

interface Line {
  readonly paths: readonly SVGPathElement[];
  readonly paint: Painter;
}

export class PoseOverlay implements Overlay {
  private group: SVGGElement | null = null;
  private lines: Line[] = [];
  private readonly hiddenLayers = new Set<Layer>();

  attach(group: SVGGElement): void {
    this.group = group;
    this.applyLayers();
  }

  /** Replaces what is drawn; `currentId` names the pose drawn in full. */
  setPoses(poses: readonly DrawnPose[], currentId: number | null): void {
    this.lines = [];
    this.group?.replaceChildren();
    for (const pose of poses.filter(({ id }) => id !== currentId)) {
      this.addOther(pose);
    }
    for (const pose of poses.filter(({ id }) => id === currentId)) {
      this.addCurrent(pose);
    }
  }

  setLayer(layer: Layer, shown: boolean): void {
    if (shown) {
      this.hiddenLayers.delete(layer);
    } else {
      this.hiddenLayers.add(layer);
    }
    this.applyLayers();
  }

  draw(view: View): void {
    for (const { paths, paint } of this.lines) {
      const d = paint(view);
      for (const path of paths) {
        path.setAttribute("d", d);
      }
    }
  }

  private applyLayers(): void {
    for (const layer of LAYERS) {
      this.group?.classList.toggle(`hides-${layer}`, this.hiddenLayers.has(layer));
    }
  }

  private addOther(pose: DrawnPose): void {
    const group = this.openGroup("overlay-pose is-other", pose.id);
    const box = drawBox(pose.corners);
    this.addLine(group, "detection", (view) => rectPath(pose.detection, view));
    if (box !== null) {
      this.addLine(group, "box", (view) => segmentsPath(box.visibleEdges, view));
    }
  }

  private addCurrent(pose: DrawnPose): void {
    const group = this.openGroup("overlay-pose is-current", pose.id);
    const { segments } = pose;
    this.addLine(group, "reported", (view) => polygonPath(segments.reported, view));
    this.addLine(group, "dead_reckoned", (view) => polygonPath(segments.dead_reckoned, view));
    this.addLine(group, "corrected", (view) => polygonPath(segments.corrected, view));
    this.addLine(group, "detection", (view) => rectPath(pose.detection, view));
    this.addBox(group, pose.corners);
  }

  private addBox(group: SVGGElement, corners: readonly Point[]): void {
    const box = drawBox(corners);
    if (box === null) {
      return;
    }
    this.addLine(group, "box", (view) => segmentsPath(box.hiddenEdges, view), "is-hidden-edge");
    const bow = box.bowIsSeen ? "is-bow" : "is-bow is-behind";
    this.addLine(group, "box", (view) => polygonPath(box.bowFace, view), bow);
    this.addLine(group, "box", (view) => segmentsPath(box.visibleEdges, view));
    for (const [name, axis] of Object.entries(box.axes)) {
      this.addLine(
        group,
        "axes",
        (view) => segmentsPath([axis], view) + arrowHead(axis, view, ARROW_PX),
        `is-${name}`,
      );
    }
  }

  private openGroup(className: string, poseId: number): SVGGElement {
    const group = document.createElementNS(SVG, "g");
    group.setAttribute("class", className);
    group.dataset["pose"] = String(poseId);
    this.group?.append(group);
    return group;
  }

  private addLine(group: SVGGElement, layer: Layer, paint: Painter, extra = ""): void {
    const paths = ["casing", "line"].map((role) => {
      const path = document.createElementNS(SVG, "path");
      path.setAttribute("class", `overlay-${role} layer-${layer} ${extra}`.trim());
      group.append(path);
      return path;
    });
    this.lines.push({ paths, paint });
  }
}
