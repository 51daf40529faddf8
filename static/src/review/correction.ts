/** A pose as a person would have it (GET /poses), beside the generated one. */
import type { components } from "../api-types";
import type { Pose } from "./pose";

export type Correction = components["schemas"]["CorrectionOut"];

/** The correction that stands; null where the generated pose does. */
export function correctionOf(pose: Pose): Correction | null {
  return pose.correction;
}

/** The pose with another correction, or with none. */
export function withCorrection(pose: Pose, correction: Correction | null, version: number): Pose {
  return { ...pose, correction, correction_version: version };
}

/** How often the pose was corrected or taken back; 0 for never. */
export function versionOf(pose: Pose): number {
  return pose.correction_version;
}
