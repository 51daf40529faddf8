/** Poses and reviews as the REST interface gives them (GET /poses, POST /poses/{id}/reviews). */
import type { components } from "../api-types";
import { correctionOf } from "./correction";
import type { DrawnPose } from "../viewer/overlay/pose-overlay";
import { boundsOf, union, type Point, type Rect } from "../viewer/view";
import { idText } from "../vessel-id";

type Schemas = components["schemas"];
export type Pose = Schemas["PoseOut"];
export type PosePage = Schemas["Page_PoseOut_"];
export type Grade = Schemas["Grade"];

export const GRADES: readonly Grade[] = ["good", "ok", "bad", "wrong"];

export const GRADE_NAMES: Readonly<Record<Grade, string>> = {
  good: "Good",
  ok: "OK",
  bad: "Bad",
  wrong: "Wrong match",
};

/** A point in the image as REST gives it: null where it cannot be projected. */
type MaybePoint = readonly number[] | null;

export function vesselName(pose: Pose): string {
  const name = pose.vessel.name?.trim() ?? "";
  return name === "" ? idText(pose.vessel.mmsi) : name;
}

export function detectionRect({ detection }: Pose): Rect {
  return {
    x1: detection.x1_px,
    y1: detection.y1_px,
    x2: detection.x2_px,
    y2: detection.y2_px,
  };
}

/** What must be in sight to judge a pose: the detection and the box that stands together. */
export function extent(pose: Pose): Rect {
  const box = boundsOf(drawn(pose).corners);
  const detection = detectionRect(pose);
  return box === null ? detection : union(detection, box);
}

export function drawn(pose: Pose): DrawnPose {
  const { reported, dead_reckoned, corrected } = pose.segments_px;
  const generated = points(pose.corners_in_image_px);
  const byHand = correctionOf(pose)?.corners_in_image_px ?? null;
  return {
    id: pose.id,
    detection: detectionRect(pose),
    corners: byHand === null ? generated : points(byHand),
    generatedCorners: byHand === null ? null : generated,
    segments: {
      reported: points(reported),
      dead_reckoned: points(dead_reckoned),
      corrected: points(corrected),
    },
  };
}

/** The pose whose detection lies under a point: the smallest one, for boxes within boxes. */
export function poseAt(poses: readonly Pose[], [u, v]: Point): Pose | null {
  const area = (rect: Rect): number => (rect.x2 - rect.x1) * (rect.y2 - rect.y1);
  const under = poses.filter((pose) => {
    const rect = extent(pose);
    return u >= rect.x1 && u <= rect.x2 && v >= rect.y1 && v <= rect.y2;
  });
  return under.sort((a, b) => area(extent(a)) - area(extent(b)))[0] ?? null;
}

export function points(values: readonly MaybePoint[]): Point[] {
  return values.map((value) => [value?.[0] ?? Number.NaN, value?.[1] ?? Number.NaN]);
}
