/** What the server gives for editing a pose (GET /poses/{id}/edit), and its camera as ours. */
import type { Camera } from "../../geometry/camera";
import type { Distortion } from "../../geometry/distortion";
import type { Mat3, Vec3 } from "../../geometry/vectors";
import type { Correction } from "../correction";
import type { LocalBox } from "./box";

export interface EditCamera {
  readonly width_px: number;
  readonly height_px: number;
  readonly fx_px: number;
  readonly fy_px: number;
  readonly cx_px: number;
  readonly cy_px: number;
  readonly distortion: readonly number[];
  readonly R_cam_from_local: readonly (readonly number[])[];
  readonly center_in_local_m: readonly number[];
}

export interface EditView {
  readonly pose_id: number;
  readonly version: number;
  readonly camera: EditCamera;
  readonly generated: LocalBox;
  /** The box that stands: the correction's, or the generated one. */
  readonly current: LocalBox;
  readonly correction: Correction | null;
}

export function cameraOf(given: EditCamera): Camera {
  return {
    intrinsics: {
      widthPx: given.width_px,
      heightPx: given.height_px,
      fxPx: given.fx_px,
      fyPx: given.fy_px,
      cxPx: given.cx_px,
      cyPx: given.cy_px,
      distortion: [...given.distortion] as unknown as Distortion,
    },
    camFromWorld: given.R_cam_from_local as unknown as Mat3,
    center: given.center_in_local_m as unknown as Vec3,
  };
}
