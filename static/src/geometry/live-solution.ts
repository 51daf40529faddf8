/**
 * A solution of the keypoints between two answers of the server: where the camera is, how far every
 * keypoint lies off, and how far it would lie off if the fit had not known it.
 *
 * The server decides at rest who agrees and whether focal length and k1 are refined; during a drag
 * both stay, and the camera follows the keypoint. All figures are then the server's own.
 */
import type { Camera, Intrinsics, Pixel } from "./camera";
import { distance, refine, residual, type Priors, type Sighting } from "./pnp";

/** What the server decided: who takes part, and what the intrinsics were refined from (or not). */
export interface Terms {
  readonly used: readonly boolean[];
  readonly refinedFrom: Intrinsics | null;
  readonly priors: Priors;
}

export interface LiveSolution {
  readonly camera: Camera;
  /** By sighting, in their order: projected minus observed; null without a projection. */
  readonly residualsPx: readonly (Pixel | null)[];
  /** Distance from the fit without it; for what was not used that is its plain error. */
  readonly leaveOneOutPx: readonly (number | null)[];
}

/** Damping for starts beside the minimum: a drag moves it by little, a missing point too. */
const NEARLY_NONE = 1e-9;

export function solveLive(
  start: Camera,
  sightings: readonly Sighting[],
  terms: Terms,
): LiveSolution {
  const isUsed = (index: number): boolean => terms.used[index] === true;
  const fit = (from: Camera, except: number): Camera =>
    refine(
      from,
      sightings.filter((_, index) => isUsed(index) && index !== except),
      terms.priors,
      terms.refinedFrom,
      NEARLY_NONE,
    );
  const camera = fit(start, -1);
  return {
    camera,
    residualsPx: sightings.map((sighting) => residual(camera, sighting)),
    leaveOneOutPx: sightings.map((sighting, index) => {
      const off = distance(isUsed(index) ? fit(camera, index) : camera, sighting);
      return Number.isFinite(off) ? off : null;
    }),
  };
}
