/** A pose as a person would have it (GET /poses), beside the generated one. */
import type { LocalBox } from "./edit/box";
import type { Pose } from "./pose";

export interface Correction {
  readonly id: number;
  readonly version: number;
  readonly kind: "edited" | "rematched";
  readonly user: string | null;
  readonly created_at: string;
  readonly mmsi: number;
  readonly vessel: Pose["vessel"];
  readonly box: LocalBox;
  readonly lat_deg: number;
  readonly lon_deg: number;
  readonly heading_deg: number;
  readonly length_m: number;
  readonly width_m: number;
  readonly height_m: number;
  readonly corners_in_image_px: Pose["corners_in_image_px"] | null;
  readonly cost: number | null;
  readonly cost_terms: Pose["cost_terms"] | null;
}

/** The correction that stands; null where the generated pose does. */
export function correctionOf(pose: Pose): Correction | null {
  return (pose as { readonly correction?: Correction | null }).correction ?? null;
}

/** The pose with another correction, or with none. */
export function withCorrection(pose: Pose, correction: Correction | null, version: number): Pose {
  return { ...pose, correction, correction_version: version } as Pose;
}

/** How often the pose was corrected or taken back; 0 for never. */
export function versionOf(pose: Pose): number {
  return (pose as { readonly correction_version?: number }).correction_version ?? 0;
}
