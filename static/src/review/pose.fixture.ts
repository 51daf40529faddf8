/** Poses for tests: complete and plausible, varied by what a test cares about. */
import type { Grade, Pose } from "./pose";

interface Varied {
  readonly id: number;
  readonly imageId: number;
  readonly grade?: Grade | null;
  readonly detection?: Pose["detection"];
  readonly corners?: Pose["corners_in_image_px"];
}

const SEGMENT = [
  [1190, 930],
  [1240, 940],
  [1490, 920],
  [1440, 910],
] as const;

export function aPose({ id, imageId, grade = null, detection, corners }: Varied): Pose {
  return {
    id,
    run_id: 1,
    image: {
      id: imageId,
      file_url: `/api/v1/images/${imageId}/file?v=abc`,
      preview_url: `/api/v1/images/${imageId}/preview?width=1280&v=abc`,
      width_px: 2560,
      height_px: 1920,
      captured_at: "2026-11-22T10:00:05Z",
      file_name: "quay.jpg",
      sha256: "abc",
    },
    vessel: { mmsi: 211111111, name: null, ship_type: 52 },
    detection: detection ?? { id, x1_px: 1178, y1_px: 808, x2_px: 1507, y2_px: 955, score: 0.9 },
    cost: 0.12,
    cost_terms: { center_x: 0.05, bottom: 0.03, width: 0.04 },
    position: { lat_deg: 53.53972, lon_deg: 9.980115, height_m: 45.2 },
    heading_deg: 112,
    heading_source: "reported",
    track_method: "heading_dr",
    report_ids: [7],
    static_ids: [],
    centroid_in_cam_m: [8.4, -2.9, 357.6],
    rotvec_cam_from_vessel: [0.27, 2.16, -1.99],
    length_m: 19,
    width_m: 7,
    height_m: 7.6,
    corners_in_image_px: corners ?? [
      ...SEGMENT,
      ...SEGMENT.map(([u, v]) => [u, v - 120] as const),
    ],
    segments_px: { reported: SEGMENT, dead_reckoned: SEGMENT, corrected: SEGMENT },
    correction_in_enu_m: [1.2, -0.4, 0],
    report_age_s: 1.5,
    speed_kn: 9.7,
    position_covariance_in_enu_m2: [
      [4, 0, 0],
      [0, 9, 0],
      [0, 0, 0.04],
    ],
    heading_sigma_deg: 2,
    height_sigma_m: 0.3,
    flags: [],
    person_made: false,
    opinions: grade === null ? 0 : 1,
    disagreement: false,
    mine: null,
    review: grade === null ? null : aReview(id, grade),
    bookmarked: false,
    comments: 0,
    correction: null,
    correction_version: 0,
  };
}

function aReview(poseId: number, grade: Grade): NonNullable<Pose["review"]> {
  return {
    id: poseId,
    pose_id: poseId,
    grade,
    reasons: [],
    comment: null,
    seconds: 1.2,
    guideline_version: 1,
    inherited: false,
    user: "ada@example.org",
    user_id: 1,
    decision: `decision-${poseId}`,
    second_opinion: false,
    settles: false,
    created_at: "2026-11-22T11:00:00Z",
    replaced_at: null,
    withdrawn_at: null,
  };
}
