/**
 * Draws the poses of one image: the current one in full, the others dimmed to their outlines.
 *
 * Layers differ in dash pattern as well as in colour. A pose that a person corrected shows the
 * corrected box, and the generated one as a thin ghost beside it.
 */
import type { Overlay } from "../viewer";
import type { Point, Rect, View } from "../view";
import { drawBox } from "./box";
import { Lines } from "./lines";
import { arrowHead, polygonPath, rectPath, segmentsPath } from "./paths";

const ARROW_PX = 9;

/** What is drawn of a pose; all points in geometry's pixels. */
export interface DrawnPose {
  readonly id: number;
  readonly detection: Rect;
  readonly corners: readonly Point[];
  /** The corners before a person corrected them; null where nobody did. */
  readonly generatedCorners: readonly Point[] | null;
  readonly segments: Readonly<Record<"reported" | "dead_reckoned" | "corrected", readonly Point[]>>;
}

export class PoseOverlay implements Overlay {
  private lines: Lines | null = null;

  attach(group: SVGGElement): void {
    this.lines = new Lines(group);
  }

  /** Replaces what is drawn; `currentId` names the pose drawn in full. */
  setPoses(poses: readonly DrawnPose[], currentId: number | null): void {
    this.lines?.clear();
    for (const pose of poses.filter(({ id }) => id !== currentId)) {
      this.addOther(pose);
    }
    for (const pose of poses.filter(({ id }) => id === currentId)) {
      this.addCurrent(pose);
    }
  }

  draw(view: View): void {
    this.lines?.draw(view);
  }

  private addOther(pose: DrawnPose): void {
    const [lines, group] = this.open("overlay-pose is-other", pose.id);
    const box = drawBox(pose.corners);
    lines.add(group, "layer-detection", (view) => rectPath(pose.detection, view));
    if (box !== null) {
      lines.add(group, "layer-box", (view) => segmentsPath(box.visibleEdges, view));
    }
  }

  private addCurrent(pose: DrawnPose): void {
    const [lines, group] = this.open("overlay-pose is-current", pose.id);
    for (const name of ["reported", "dead_reckoned", "corrected"] as const) {
      lines.add(group, `layer-${name}`, (view) => polygonPath(pose.segments[name], view));
    }
    lines.add(group, "layer-detection", (view) => rectPath(pose.detection, view));
    addGhost(lines, group, pose.generatedCorners ?? []);
    addBox(lines, group, pose.corners);
  }

  private open(className: string, poseId: number): [Lines, SVGGElement] {
    if (this.lines === null) {
      throw new Error("The overlay is not attached yet.");
    }
    const group = this.lines.group(className);
    group.dataset["pose"] = String(poseId);
    return [this.lines, group];
  }
}

/** A 3D box with its bow marked and its axes. */
export function addBox(lines: Lines, group: SVGGElement, corners: readonly Point[]): void {
  const box = drawBox(corners);
  if (box === null) {
    return;
  }
  lines.add(group, "layer-box is-hidden-edge", (view) => segmentsPath(box.hiddenEdges, view));
  const bow = box.bowIsSeen ? "is-bow" : "is-bow is-behind";
  lines.add(group, `layer-box ${bow}`, (view) => polygonPath(box.bowFace, view));
  lines.add(group, "layer-box", (view) => segmentsPath(box.visibleEdges, view));
  for (const [name, axis] of Object.entries(box.axes)) {
    lines.add(
      group,
      `layer-axes is-${name}`,
      (view) => segmentsPath([axis], view) + arrowHead(axis, view, ARROW_PX),
    );
  }
}

/** The edges of a box as it was before. */
export function addGhost(lines: Lines, group: SVGGElement, corners: readonly Point[]): void {
  const box = drawBox(corners);
  if (box !== null) {
    const edges = [...box.visibleEdges, ...box.hiddenEdges];
    lines.add(group, "layer-generated", (view) => segmentsPath(edges, view));
  }
}
