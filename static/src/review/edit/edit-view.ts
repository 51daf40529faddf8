/** What the server gives for editing a pose (GET /poses/{id}/edit), and its camera as ours. */
import type { components } from "../../api-types";
import type { Camera } from "../../geometry/camera";
import type { Distortion } from "../../geometry/distortion";
import type { Mat3, Vec3 } from "../../geometry/vectors";

export type EditCamera = components["schemas"]["LocalCameraOut"];
/** `current` is the box that stands: the correction's, or the generated one. */
export type EditView = components["schemas"]["EditOut"];

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
