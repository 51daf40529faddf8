/** Poses and reviews as the REST interface gives them (GET /poses, POST /poses/{id}/reviews). */
import type { DrawnPose } from "../viewer/overlay/pose-overlay";
import { boundsOf, union, type Point, type Rect } from "../viewer/view";

export const GRADES = ["good", "ok", "bad", "wrong"] as const;
export type Grade = (typeof GRADES)[number];

export const GRADE_NAMES: Readonly<Record<Grade, string>> = {
  good: "Good",
  ok: "OK",
  bad: "Bad",
  wrong: "Wrong match",
};

/** A point in the image; null coordinates stand for a point that cannot be projected. */
type MaybePoint = readonly [number | null, number | null];

export interface PoseImage {
  readonly id: number;
  readonly file_url: string;
  readonly preview_url: string;
  readonly width_px: number;
  readonly height_px: number;
  readonly captured_at: string;
  readonly file_name: string;
}

export interface Pose {
  readonly id: number;
  readonly run_id: number;
  readonly image: PoseImage;
  readonly vessel: {
    readonly mmsi: number;
    readonly name: string | null;
    readonly ship_type: number | string | null;
  };
  readonly detection: {
    readonly x1_px: number;
    readonly y1_px: number;
    readonly x2_px: number;
    readonly y2_px: number;
    readonly score: number;
  };
  readonly cost: number;
  readonly cost_terms: Readonly<Record<string, number>>;
  readonly position: {
    readonly lat_deg: number;
    readonly lon_deg: number;
    readonly height_m: number;
  };
  readonly heading_deg: number;
  readonly heading_source: string;
  readonly centroid_in_cam_m: readonly number[];
  readonly length_m: number;
  readonly width_m: number;
  readonly height_m: number;
  readonly corners_in_image_px: readonly MaybePoint[];
  readonly segments_px: Readonly<
    Record<"reported" | "dead_reckoned" | "corrected", readonly MaybePoint[] | null>
  >;
  readonly correction_in_enu_m: readonly number[];
  readonly report_age_s: number | null;
  readonly flags: readonly string[];
  readonly review: { readonly grade: Grade; readonly user: string | null } | null;
}

export interface PosePage {
  readonly items: readonly Pose[];
  readonly next_cursor: string | null;
}

export function vesselName(pose: Pose): string {
  const name = pose.vessel.name?.trim() ?? "";
  return name === "" ? `MMSI ${pose.vessel.mmsi}` : name;
}

export function detectionRect({ detection }: Pose): Rect {
  return {
    x1: detection.x1_px,
    y1: detection.y1_px,
    x2: detection.x2_px,
    y2: detection.y2_px,
  };
}

/** What must be in sight to judge a pose: the detection and the projected box together. */
export function extent(pose: Pose): Rect {
  const box = boundsOf(points(pose.corners_in_image_px));
  const detection = detectionRect(pose);
  return box === null ? detection : union(detection, box);
}

export function drawn(pose: Pose): DrawnPose {
  const { reported, dead_reckoned, corrected } = pose.segments_px;
  return {
    id: pose.id,
    detection: detectionRect(pose),
    corners: points(pose.corners_in_image_px),
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

function points(values: readonly MaybePoint[] | null): Point[] {
  return (values ?? []).map(([u, v]) => [u ?? Number.NaN, v ?? Number.NaN]);
}
