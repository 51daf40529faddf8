/**
 * Where the sea ends: points of the geometric horizon of a camera above the water, in its image.
 *
 * From a height h the eye touches the sphere of radius R at a dip of acos(R / (R + h)) below the
 * level: 0.17 degrees from 30 m, 20 px for a long lens. Refraction lifts it by a twelfth or so and
 * is left out, as it changes with the weather.
 */
import { projectFromCam, type Camera, type Pixel } from "./camera";
import { apply, type Vec3 } from "./vectors";

const EARTH_RADIUS_M = 6_371_000;
const STEP_DEG = 0.5;

/** The horizon from left to right as pieces of a line; empty below the water or out of sight. */
export function horizonOf(camera: Camera, heightAboveWaterM: number): readonly (readonly Pixel[])[] {
  if (!(heightAboveWaterM > 0)) {
    return [];
  }
  const dip = Math.acos(EARTH_RADIUS_M / (EARTH_RADIUS_M + heightAboveWaterM));
  const [down, out] = [-Math.sin(dip), Math.cos(dip)];
  // From behind the camera, so that what it sees is one piece.
  const [east, north] = camera.camFromWorld[2];
  const behind = Math.atan2(east, north) - Math.PI;
  const pieces: Pixel[][] = [];
  let piece: Pixel[] = [];
  for (let turn = 0; turn <= 360; turn += STEP_DEG) {
    const azimuth = behind + (turn * Math.PI) / 180;
    const direction: Vec3 = [out * Math.sin(azimuth), out * Math.cos(azimuth), down];
    const pixel = projectFromCam(camera.intrinsics, apply(camera.camFromWorld, direction));
    if (pixel !== null && isNear(pixel, camera)) {
      piece.push(pixel);
    } else if (piece.length > 0) {
      pieces.push(piece);
      piece = [];
    }
  }
  return [...pieces, piece].filter(({ length }) => length > 1);
}

/** Within an image's size of the image: far enough to leave no gap at its borders. */
function isNear([u, v]: Pixel, { intrinsics: { widthPx, heightPx } }: Camera): boolean {
  return u > -widthPx && u < 2 * widthPx && v > -heightPx && v < 2 * heightPx;
}
