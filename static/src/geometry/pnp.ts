/**
 * The camera that agrees best with its keypoints: Levenberg and Marquardt, as on the server.
 *
 * The same sum of squares as the server's `app/domain/pnp.py` (keypoints by the sigma of a pixel;
 * focal length and k1, when refined, held by priors), so both end at the same minimum. Unknowns of
 * a step: a small rotation of the camera frame (rad), the centre (m), then the logarithm of the
 * focal lengths and k1.
 */
import { project, toCam, type Camera, type Intrinsics, type Pixel } from "./camera";
import { distortionJacobian, type Distortion } from "./distortion";
import { at, solveSymmetric } from "./linear";
import { matrixFromRotvec } from "./rotation";
import { add, multiply, type Mat3, type Vec3 } from "./vectors";

/** A landmark in the world (metres) and the pixel at which it is seen. */
export interface Sighting {
  readonly point: Vec3;
  readonly pixel: Pixel;
}

/** Sigmas known before: of a keypoint's pixel, of the relative focal length, of k1. */
export interface Priors {
  readonly pixelPx: number;
  readonly focal: number;
  readonly k1: number;
}

const MAXIMUM_STEPS = 60;
/** Gain that a step promises, in squared sigmas: it moves no point by more than 1e-8 px. */
const CONVERGED = 1e-18;
const GIVING_UP = 1e12;

interface Linearised {
  readonly cost: number;
  readonly normal: Float64Array;
  readonly gradient: Float64Array;
}

/**
 * Moves a camera downhill to the least squared reprojection error. With `refinedFrom` focal length
 * and k1 move too. A start with points behind the camera comes back as it is.
 */
export function refine(
  start: Camera,
  sightings: readonly Sighting[],
  priors: Priors,
  refinedFrom: Intrinsics | null,
): Camera {
  const n = refinedFrom === null ? 6 : 8;
  let camera = start;
  let here = linearise(camera, sightings, priors, refinedFrom);
  let damping = 1e-3;
  if (here === null) {
    return start;
  }
  for (let step = 0; step < MAXIMUM_STEPS; step += 1) {
    const move = solveSymmetric(damped(here.normal, damping, n), here.gradient, n);
    const moved = move === null ? null : stepped(camera, move);
    if (move !== null && moved !== null && promised(move, here.gradient) <= CONVERGED) {
      return moved; // the sum itself is rounded more coarsely than this
    }
    const there = moved === null ? null : linearise(moved, sightings, priors, refinedFrom);
    if (moved === null || there === null || there.cost > here.cost) {
      damping *= 10;
      if (damping > GIVING_UP) {
        break;
      }
      continue;
    }
    camera = moved;
    here = there;
    damping = Math.max(damping / 10, 1e-12);
  }
  return camera;
}

/** Projected minus observed pixels; null where a point has no projection. */
export function residual(camera: Camera, { point, pixel }: Sighting): Pixel | null {
  const shown = project(camera, point);
  return shown === null ? null : [shown[0] - pixel[0], shown[1] - pixel[1]];
}

/** How far a keypoint lies from its projection, px; infinite where it has none. */
export function distance(camera: Camera, sighting: Sighting): number {
  const off = residual(camera, sighting);
  return off === null ? Infinity : Math.hypot(off[0], off[1]);
}

function promised(move: Float64Array, gradient: Float64Array): number {
  return move.reduce((sum, part, index) => sum + part * at(gradient, index), 0);
}

function damped(normal: Float64Array, damping: number, n: number): Float64Array {
  const raised = new Float64Array(normal);
  for (let k = 0; k < n; k += 1) {
    const own = at(normal, k * n + k);
    raised[k * n + k] = own + damping * (own + 1e-15);
  }
  return raised;
}

/** Sums up cost, J^T J and -J^T r; null where a point has no projection. */
function linearise(
  camera: Camera,
  sightings: readonly Sighting[],
  priors: Priors,
  refinedFrom: Intrinsics | null,
): Linearised | null {
  const n = refinedFrom === null ? 6 : 8;
  const sums = { cost: 0, normal: new Float64Array(n * n), gradient: new Float64Array(n) };
  for (const sighting of sightings) {
    const off = residual(camera, sighting);
    if (off === null) {
      return null;
    }
    const [byU, byV] = projectionJacobian(camera, sighting.point);
    accumulate(sums, byU, off[0], priors.pixelPx, n);
    accumulate(sums, byV, off[1], priors.pixelPx, n);
  }
  if (refinedFrom !== null) {
    const logFocal = Math.log(camera.intrinsics.fxPx / refinedFrom.fxPx);
    const k1 = camera.intrinsics.distortion[0] - refinedFrom.distortion[0];
    accumulate(sums, unit(6), logFocal, priors.focal, n);
    accumulate(sums, unit(7), k1, priors.k1, n);
  }
  return Number.isFinite(sums.cost) ? sums : null;
}

function unit(index: number): Float64Array {
  const row = new Float64Array(8);
  row[index] = 1;
  return row;
}

function accumulate(
  sums: { cost: number; normal: Float64Array; gradient: Float64Array },
  row: Float64Array,
  off: number,
  sigma: number,
  n: number,
): void {
  const weight = 1 / (sigma * sigma);
  sums.cost += off * off * weight;
  for (let i = 0; i < n; i += 1) {
    const left = at(row, i) * weight;
    sums.gradient[i] = at(sums.gradient, i) - left * off;
    for (let j = 0; j <= i; j += 1) {
      const value = at(sums.normal, i * n + j) + left * at(row, j);
      sums.normal[i * n + j] = value;
      sums.normal[j * n + i] = value;
    }
  }
}

/** The derivatives of a point's u and v by the eight unknowns. */
export function projectionJacobian(
  camera: Camera,
  point: Vec3,
): readonly [Float64Array, Float64Array] {
  const [x, y, z] = toCam(camera, point);
  const { fxPx, fyPx, cxPx, cyPx, distortion } = camera.intrinsics;
  const ideal = [x / z, y / z] as const;
  const [a, b, c, d] = distortionJacobian(distortion, ideal);
  const shown = project(camera, point) ?? [Number.NaN, Number.NaN];
  const r2 = ideal[0] ** 2 + ideal[1] ** 2;
  return [
    row(camera.camFromWorld, [x, y, z], [fxPx * a, fxPx * b], shown[0] - cxPx, fxPx * ideal[0] * r2),
    row(camera.camFromWorld, [x, y, z], [fyPx * c, fyPx * d], shown[1] - cyPx, fyPx * ideal[1] * r2),
  ];
}

function row(
  R: Mat3,
  [x, y, z]: Vec3,
  [byX, byY]: readonly [number, number],
  byLogFocal: number,
  byK1: number,
): Float64Array {
  // By the point in the camera's frame, then by a turn (-[X]x) and by the centre (-R).
  const p = byX / z;
  const q = byY / z;
  const s = -(byX * x + byY * y) / (z * z);
  return Float64Array.of(
    -q * z + s * y,
    p * z - s * x,
    -p * y + q * x,
    -(p * R[0][0] + q * R[1][0] + s * R[2][0]),
    -(p * R[0][1] + q * R[1][1] + s * R[2][1]),
    -(p * R[0][2] + q * R[1][2] + s * R[2][2]),
    byLogFocal,
    byK1,
  );
}

function stepped(camera: Camera, step: Float64Array): Camera {
  const turn = matrixFromRotvec([at(step, 0), at(step, 1), at(step, 2)]);
  const center = add(camera.center, [at(step, 3), at(step, 4), at(step, 5)]);
  const camFromWorld = multiply(turn, camera.camFromWorld);
  if (step.length === 6) {
    return { intrinsics: camera.intrinsics, camFromWorld, center };
  }
  const { intrinsics } = camera;
  const factor = Math.exp(at(step, 6));
  const [k1, k2, p1, p2, k3] = intrinsics.distortion;
  const distortion: Distortion = [k1 + at(step, 7), k2, p1, p2, k3];
  const refined = {
    ...intrinsics,
    fxPx: intrinsics.fxPx * factor,
    fyPx: intrinsics.fyPx * factor,
    distortion,
  };
  return { intrinsics: refined, camFromWorld, center };
}
