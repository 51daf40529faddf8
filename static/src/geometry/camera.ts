/**
 * The pinhole camera with lens distortion, as on the server: metres of the world to pixels and back.
 *
 * The camera frame is OpenCV's (x right, y down, z forward) and `X_cam = R (X_world - center)`.
 * Pixel (0, 0) is the centre of the first pixel; SVG and CSS need half a pixel more, which the
 * viewer adds (viewer/view.ts).
 */
import { distort, undistort, type Distortion } from "./distortion";
import { matrixFromRotvec } from "./rotation";
import { add, apply, length, scale, subtract, transpose, type Mat3, type Vec3 } from "./vectors";

/** A pixel [u, v] in geometry's coordinates. */
export type Pixel = readonly [u: number, v: number];

export interface Intrinsics {
  readonly widthPx: number;
  readonly heightPx: number;
  readonly fxPx: number;
  readonly fyPx: number;
  readonly cxPx: number;
  readonly cyPx: number;
  readonly distortion: Distortion;
}

export interface Camera {
  readonly intrinsics: Intrinsics;
  readonly camFromWorld: Mat3;
  readonly center: Vec3;
}

/** A camera from a Rodrigues vector of cam_from_world and its centre in that world, metres. */
export function cameraFrom(intrinsics: Intrinsics, rotvec: Vec3, center: Vec3): Camera {
  return { intrinsics, camFromWorld: matrixFromRotvec(rotvec), center };
}

/** A world point in the camera's frame, metres. */
export function toCam(camera: Camera, point: Vec3): Vec3 {
  return apply(camera.camFromWorld, subtract(point, camera.center));
}

/** The pixel of a world point; null behind the camera or where the lens is not one-to-one. */
export function project(camera: Camera, point: Vec3): Pixel | null {
  return projectFromCam(camera.intrinsics, toCam(camera, point));
}

/** The pixel of a point given in the camera's frame, metres; null as for `project`. */
export function projectFromCam(intrinsics: Intrinsics, [x, y, z]: Vec3): Pixel | null {
  if (!(z > 0)) {
    return null;
  }
  const shown = distort(intrinsics.distortion, [x / z, y / z]);
  return shown === null
    ? null
    : [
        shown[0] * intrinsics.fxPx + intrinsics.cxPx,
        shown[1] * intrinsics.fyPx + intrinsics.cyPx,
      ];
}

/** The line of sight of a pixel as a unit direction in the world; null where nothing is shown. */
export function unproject(camera: Camera, [u, v]: Pixel): Vec3 | null {
  const { fxPx, fyPx, cxPx, cyPx, distortion } = camera.intrinsics;
  const ideal = undistort(distortion, [(u - cxPx) / fxPx, (v - cyPx) / fyPx]);
  if (ideal === null) {
    return null;
  }
  const inCam: Vec3 = [ideal[0], ideal[1], 1];
  return apply(transpose(camera.camFromWorld), scale(inCam, 1 / length(inCam)));
}

/** Where a pixel's line of sight meets the plane z = `levelM` of the world; null if it does not. */
export function onWater(camera: Camera, pixel: Pixel, levelM: number): Vec3 | null {
  const ray = unproject(camera, pixel);
  if (ray === null) {
    return null;
  }
  const distance = (levelM - camera.center[2]) / ray[2];
  return distance > 0 && Number.isFinite(distance)
    ? add(camera.center, scale(ray, distance))
    : null;
}

export function isInImage({ widthPx, heightPx }: Intrinsics, [u, v]: Pixel): boolean {
  return u >= -0.5 && v >= -0.5 && u <= widthPx - 0.5 && v <= heightPx - 0.5;
}
