/**
 * Lens distortion after Brown and Conrady (OpenCV's k1, k2, p1, p2, k3), and where it can be trusted.
 *
 * The same rules as the server's domain: the model is believed only where it is one-to-one, from
 * the centre out to the radius at which the radial polynomial stops growing, so that what lies far
 * beside the lens never folds back onto the picture.
 */

export type Distortion = readonly [k1: number, k2: number, p1: number, p2: number, k3: number];
export type Plane = readonly [x: number, y: number];
/** Rows of a 2 x 2 matrix, flattened: dx'/dx, dx'/dy, dy'/dx, dy'/dy. */
export type Jacobian2 = readonly [number, number, number, number];

export const NO_DISTORTION: Distortion = [0, 0, 0, 0, 0];
const BISECTIONS = 60;
const NEWTON_STEPS = 12;
const SETTLED = 1e-13;

/** Where the lens shows an ideal point of the normalised plane; null where it is not one-to-one. */
export function distort(lens: Distortion, point: Plane): Plane | null {
  const [x, y] = point;
  const limit = oneToOneRadius(lens);
  if (!(x * x + y * y < limit * limit)) {
    return null;
  }
  const [a, b, c, d] = distortionJacobian(lens, point);
  return a * d - b * c > 0 ? moved(lens, point) : null;
}

/** The ideal point that the lens shows at `point`; null where none is. */
export function undistort(lens: Distortion, point: Plane): Plane | null {
  if (lens.every((term) => term === 0)) {
    return point;
  }
  let ideal = radialStart(lens, point);
  for (let step = 0; step < NEWTON_STEPS; step += 1) {
    const [u, v] = moved(lens, ideal);
    const [du, dv] = [u - point[0], v - point[1]];
    if (!(Math.abs(du) > SETTLED || Math.abs(dv) > SETTLED)) {
      break;
    }
    const [a, b, c, d] = distortionJacobian(lens, ideal);
    const determinant = a * d - b * c;
    ideal = [
      ideal[0] - (d * du - b * dv) / determinant,
      ideal[1] - (a * dv - c * du) / determinant,
    ];
  }
  const shown = distort(lens, ideal);
  const isThere =
    shown !== null &&
    Math.abs(shown[0] - point[0]) < 1e-11 &&
    Math.abs(shown[1] - point[1]) < 1e-11;
  return isThere ? ideal : null;
}

/** The distorted point by the ideal one. */
export function distortionJacobian(lens: Distortion, [x, y]: Plane): Jacobian2 {
  const [k1, k2, p1, p2, k3] = lens;
  const r2 = x * x + y * y;
  const radial = radialFactor(lens, r2);
  const slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));
  const cross = slope * x * y + 2 * (p1 * x + p2 * y);
  return [
    radial + slope * x * x + 2 * p1 * y + 6 * p2 * x,
    cross,
    cross,
    radial + slope * y * y + 6 * p1 * y + 2 * p2 * x,
  ];
}

/** One lens serves thousands of projections between two changes. */
const radii = new WeakMap<Distortion, number>();

/** Radius on the normalised plane at which r + k1 r^3 + k2 r^5 + k3 r^7 stops growing. */
export function oneToOneRadius(lens: Distortion): number {
  const known = radii.get(lens);
  if (known !== undefined) {
    return known;
  }
  const radius = turningRadius(lens);
  radii.set(lens, radius);
  return radius;
}

function turningRadius([k1, k2, , , k3]: Distortion): number {
  // The polynomial's derivative, as one of s = r^2.
  const roots = realRoots(7 * k3, 5 * k2, 3 * k1, 1).filter((root) => root > 0);
  return roots.length === 0 ? Infinity : Math.sqrt(Math.min(...roots));
}

function realRoots(a: number, b: number, c: number, d: number): number[] {
  if (a === 0) {
    return quadraticRoots(b, c, d);
  }
  const [B, C, D] = [b / a, c / a, d / a];
  const q = (3 * C - B * B) / 9;
  const r = (9 * B * C - 27 * D - 2 * B * B * B) / 54;
  const discriminant = q * q * q + r * r;
  if (discriminant > 0) {
    const s = Math.sqrt(discriminant);
    return [Math.cbrt(r + s) + Math.cbrt(r - s) - B / 3];
  }
  const angle = Math.acos(Math.max(-1, Math.min(1, r / Math.sqrt(-q * q * q))));
  const third = (turns: number): number =>
    2 * Math.sqrt(-q) * Math.cos((angle + 2 * Math.PI * turns) / 3) - B / 3;
  return q === 0 ? [Math.cbrt(2 * r) - B / 3] : [third(0), third(1), third(2)];
}

function quadraticRoots(a: number, b: number, c: number): number[] {
  if (a === 0) {
    return b === 0 ? [] : [-c / b];
  }
  const discriminant = b * b - 4 * a * c;
  if (discriminant < 0) {
    return [];
  }
  const half = -(b + Math.sign(b || 1) * Math.sqrt(discriminant)) / 2;
  return half === 0 ? [0] : [half / a, c / half];
}

function radialFactor([k1, k2, , , k3]: Distortion, r2: number): number {
  return 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
}

/** OpenCV's formula, wherever it leads. */
function moved(lens: Distortion, [x, y]: Plane): Plane {
  const [, , p1, p2] = lens;
  const r2 = x * x + y * y;
  const radial = radialFactor(lens, r2);
  return [
    x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
    y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
  ];
}

/** Undoes the radial part by bisection inside the one-to-one range: never the folded branch. */
function radialStart(lens: Distortion, [x, y]: Plane): Plane {
  const shown = Math.hypot(x, y);
  if (shown === 0) {
    return [x, y];
  }
  const reaches = (radius: number): boolean =>
    radius * radialFactor(lens, radius * radius) >= shown;
  let low = 0;
  let high = oneToOneRadius(lens);
  if (!Number.isFinite(high)) {
    high = 1;
    while (!reaches(high) && Number.isFinite(high)) {
      high *= 2;
    }
  }
  for (let step = 0; step < BISECTIONS; step += 1) {
    const middle = (low + high) / 2;
    if (reaches(middle)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return [(x * high) / shown, (y * high) / shown];
}
