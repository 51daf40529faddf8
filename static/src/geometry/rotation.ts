/** Rotation matrices and Rodrigues vectors: the axis, as long as the angle in radians. */
import { length, type Mat3, type Vec3 } from "./vectors";

/** Below this angle the series is exact to the last bit of a double. */
const SMALL_RAD = 1e-8;

export function matrixFromRotvec(rotvec: Vec3): Mat3 {
  const [x, y, z] = rotvec;
  const angle = length(rotvec);
  const a = angle < SMALL_RAD ? 1 : Math.sin(angle) / angle;
  const b = angle < SMALL_RAD ? 0.5 : (1 - Math.cos(angle)) / (angle * angle);
  return [
    [1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
    [b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x],
    [b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)],
  ];
}

/** The Rodrigues vector of a rotation; angles reach from 0 to pi. */
export function rotvecFromMatrix(R: Mat3): Vec3 {
  // By way of the unit quaternion, whose largest part is never small.
  const [[a, b, c], [d, e, f], [g, h, i]] = R;
  const squares = [1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i];
  const largest = squares.indexOf(Math.max(...squares));
  const part = Math.sqrt(squares[largest] ?? 1) / 2;
  const [w, x, y, z] = quaternion(largest, part, [h - f, c - g, d - b], [b + d, c + g, f + h]);
  const sine = Math.hypot(x, y, z);
  if (sine < SMALL_RAD) {
    return [2 * x * Math.sign(w), 2 * y * Math.sign(w), 2 * z * Math.sign(w)];
  }
  const half = w < 0 ? -1 : 1;
  const factor = (half * 2 * Math.atan2(sine, Math.abs(w))) / sine;
  return [x * factor, y * factor, z * factor];
}

function quaternion(
  largest: number,
  part: number,
  [dx, dy, dz]: Vec3,
  [xy, xz, yz]: Vec3,
): readonly [number, number, number, number] {
  const q = 4 * part;
  switch (largest) {
    case 0:
      return [part, dx / q, dy / q, dz / q];
    case 1:
      return [dx / q, part, xy / q, xz / q];
    case 2:
      return [dy / q, xy / q, part, yz / q];
    default:
      return [dz / q, xz / q, yz / q, part];
  }
}
