/**
 * The camera that agrees best with its keypoints: Levenberg and Marquardt, as on the server.
 *
 * The same sum of squares as the server's `app/domain/pnp.py` (keypoints by the sigma of a pixel;
 * focal length and k1, when refined, held by priors), so both end at the same minimum. Unknowns of
 * a step: a small rotation of the camera frame (rad), the centre (m), then the logarithm of the
 * focal lengths and k1.
 */
import { project, type Camera, type Intrinsics, type Pixel } from "./camera";
import { distort, distortionJacobian, type Distortion } from "./distortion";
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
 * and k1 move too. A start with points behind the camera comes back as it is. A start that is known
 * to be near needs no damping at first; it comes by itself where a step leads uphill.
 */
export function refine(
  start: Camera,
  sightings: readonly Sighting[],
  priors: Priors,
  refinedFrom: Intrinsics | null,
  firstDamping = 1e-3,
): Camera {
  const n = refinedFrom === null ? 6 : 8;
  let camera = start;
  let here = linearise(camera, sightings, priors, refinedFrom);
  let damping = firstDamping;
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

/**
 * Sums up cost, J^T J and -J^T r; null where a point has no projection. Leave-one-out asks for this
 * thousands of times within a frame, so nothing is allocated for a point.
 */
function linearise(
  camera: Camera,
  sightings: readonly Sighting[],
  priors: Priors,
  refinedFrom: Intrinsics | null,
): Linearised | null {
  const n = refinedFrom === null ? 6 : 8;
  const sums = { cost: 0, normal: new Float64Array(n * n), gradient: new Float64Array(n) };
  const weight = 1 / (priors.pixelPx * priors.pixelPx);
  for (const sighting of sightings) {
    if (!differentiate(camera, sighting.point, ROW_U, ROW_V, SHOWN)) {
      return null;
    }
    accumulate(sums, ROW_U, at(SHOWN, 0) - sighting.pixel[0], weight, n);
    accumulate(sums, ROW_V, at(SHOWN, 1) - sighting.pixel[1], weight, n);
  }
  if (refinedFrom !== null) {
    const logFocal = Math.log(camera.intrinsics.fxPx / refinedFrom.fxPx);
    const k1 = camera.intrinsics.distortion[0] - refinedFrom.distortion[0];
    accumulate(sums, LOG_FOCAL, logFocal, 1 / priors.focal ** 2, n);
    accumulate(sums, K1, k1, 1 / priors.k1 ** 2, n);
  }
  if (!Number.isFinite(sums.cost)) {
    return null;
  }
  for (let i = 0; i < n; i += 1) {
    for (let j = 0; j < i; j += 1) {
      sums.normal[j * n + i] = at(sums.normal, i * n + j);
    }
  }
  return sums;
}

const ROW_U = new Float64Array(8);
const ROW_V = new Float64Array(8);
const SHOWN = new Float64Array(2);
const LOG_FOCAL = Float64Array.of(0, 0, 0, 0, 0, 0, 1, 0);
const K1 = Float64Array.of(0, 0, 0, 0, 0, 0, 0, 1);

/** Adds one row to the lower half of the normal equations. */
function accumulate(
  sums: { cost: number; normal: Float64Array; gradient: Float64Array },
  row: Float64Array,
  off: number,
  weight: number,
  n: number,
): void {
  sums.cost += off * off * weight;
  for (let i = 0; i < n; i += 1) {
    const left = at(row, i) * weight;
    sums.gradient[i] = at(sums.gradient, i) - left * off;
    for (let j = 0; j <= i; j += 1) {
      sums.normal[i * n + j] = at(sums.normal, i * n + j) + left * at(row, j);
    }
  }
}

/**
 * Fills in a point's pixel and the derivatives of its u and v by the eight unknowns; false where it
 * has no projection.
 */
function differentiate(
  camera: Camera,
  point: Vec3,
  rowU: Float64Array,
  rowV: Float64Array,
  shown: Float64Array,
): boolean {
  const [R, C] = [camera.camFromWorld, camera.center];
  const [dx, dy, dz] = [point[0] - C[0], point[1] - C[1], point[2] - C[2]];
  const x = R[0][0] * dx + R[0][1] * dy + R[0][2] * dz;
  const y = R[1][0] * dx + R[1][1] * dy + R[1][2] * dz;
  const z = R[2][0] * dx + R[2][1] * dy + R[2][2] * dz;
  if (!(z > 0)) {
    return false;
  }
  const { fxPx, fyPx, cxPx, cyPx, distortion } = camera.intrinsics;
  const ideal = [x / z, y / z] as const;
  const seen = distort(distortion, ideal);
  if (seen === null) {
    return false;
  }
  shown[0] = fxPx * seen[0] + cxPx;
  shown[1] = fyPx * seen[1] + cyPx;
  const [a, b, c, d] = distortionJacobian(distortion, ideal);
  const r2 = ideal[0] * ideal[0] + ideal[1] * ideal[1];
  fillRow(rowU, R, x, y, z, fxPx * a, fxPx * b);
  fillRow(rowV, R, x, y, z, fyPx * c, fyPx * d);
  rowU[6] = fxPx * seen[0];
  rowV[6] = fyPx * seen[1];
  rowU[7] = fxPx * ideal[0] * r2;
  rowV[7] = fyPx * ideal[1] * r2;
  return true;
}

/** By the point in the camera's frame, then by a turn (-[X]x) and by the centre (-R). */
function fillRow(
  row: Float64Array,
  R: Mat3,
  x: number,
  y: number,
  z: number,
  byX: number,
  byY: number,
): void {
  const p = byX / z;
  const q = byY / z;
  const s = -(byX * x + byY * y) / (z * z);
  row[0] = s * y - q * z;
  row[1] = p * z - s * x;
  row[2] = q * x - p * y;
  row[3] = -(p * R[0][0] + q * R[1][0] + s * R[2][0]);
  row[4] = -(p * R[0][1] + q * R[1][1] + s * R[2][1]);
  row[5] = -(p * R[0][2] + q * R[1][2] + s * R[2][2]);
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
