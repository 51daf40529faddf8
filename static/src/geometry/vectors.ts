/**
 * Vectors and 3 x 3 matrices as plain tuples: the few operations that a camera needs, without a
 * library, so that a drag can solve hundreds of projections between two frames.
 */

export type Vec3 = readonly [number, number, number];
/** Rows of a matrix. */
export type Mat3 = readonly [Vec3, Vec3, Vec3];

export const IDENTITY: Mat3 = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

export function add(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function subtract(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scale(a: Vec3, factor: number): Vec3 {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function dot(a: Vec3, b: Vec3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function length(a: Vec3): number {
  return Math.hypot(a[0], a[1], a[2]);
}

/** `M x`: the rows of M against x. */
export function apply(M: Mat3, x: Vec3): Vec3 {
  return [dot(M[0], x), dot(M[1], x), dot(M[2], x)];
}

export function transpose(M: Mat3): Mat3 {
  return [
    [M[0][0], M[1][0], M[2][0]],
    [M[0][1], M[1][1], M[2][1]],
    [M[0][2], M[1][2], M[2][2]],
  ];
}

/** `A B`. */
export function multiply(A: Mat3, B: Mat3): Mat3 {
  const columns = transpose(B);
  const row = (a: Vec3): Vec3 => [dot(a, columns[0]), dot(a, columns[1]), dot(a, columns[2])];
  return [row(A[0]), row(A[1]), row(A[2])];
}
