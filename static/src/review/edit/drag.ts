/**
 * What dragging a handle of the box does to it. A handle sits at a point of the box; wherever the
 * pointer leads it, the box changes so that this point stays under the pointer as well as it can.
 *
 * On the water the pointer's line of sight meets the plane of the box's bottom. A face moves along
 * its own axis only: how far is found from where that axis points in the image, because a line of
 * sight that skims the water would turn a pixel into a hundred metres.
 */
import { onWater, project, type Camera } from "../../geometry/camera";
import { add, scale, type Vec3 } from "../../geometry/vectors";
import type { Point } from "../../viewer/view";
import {
  axesOf,
  movedBy,
  pointOf,
  resized,
  stretched,
  turnBetween,
  turnedTo,
  type LocalBox,
} from "./box";

export const HANDLES = ["move", "turn", "bow", "stern", "port", "starboard", "top"] as const;
export type Handle = (typeof HANDLES)[number];

/** The turn handle stands before the bow, by this share of the half length beyond it. */
const TURN_REACH = 1.55;
const ROUNDS = 6;
/** An axis that the camera looks along: a metre of it shows less than this, and is not dragged. */
const LEAST_PX_PER_M = 0.05;

/** Where a handle sits, in the local frame. */
export function handlePoint(box: LocalBox, handle: Handle): Vec3 {
  switch (handle) {
    case "move":
      return pointOf(box, 0, 0, 0);
    case "turn":
      return pointOf(box, TURN_REACH, 0, 0);
    case "bow":
      return pointOf(box, 1, 0, 0.5);
    case "stern":
      return pointOf(box, -1, 0, 0.5);
    case "port":
      return pointOf(box, 0, 1, 0.5);
    case "starboard":
      return pointOf(box, 0, -1, 0.5);
    case "top":
      return pointOf(box, 0, 0, 1);
  }
}

export function handlePixel(camera: Camera, box: LocalBox, handle: Handle): Point | null {
  return project(camera, handlePoint(box, handle));
}

/** The point of the box that a handle takes hold of: the turn handle leads the bow. */
export function gripPixel(camera: Camera, box: LocalBox, handle: Handle): Point | null {
  return handle === "turn"
    ? project(camera, pointOf(box, 1, 0, 0))
    : handlePixel(camera, box, handle);
}

/** The box after a drag that began on `start` at pixel `from` and has come to pixel `to`. */
export function dragged(
  camera: Camera,
  start: LocalBox,
  handle: Handle,
  from: Point,
  to: Point,
): LocalBox {
  switch (handle) {
    case "move":
      return moved(camera, start, from, to);
    case "turn":
      return turned(camera, start, from, to);
    case "top": {
      const by = alongAxis(camera, handlePoint(start, "top"), [0, 0, 1], from, to);
      return resized(start, "height_m", start.height_m + by);
    }
    case "bow":
    case "stern":
      return stretchedFace(camera, start, handle, "length_m", from, to);
    case "port":
    case "starboard":
      return stretchedFace(camera, start, handle, "width_m", from, to);
  }
}

function moved(camera: Camera, start: LocalBox, from: Point, to: Point): LocalBox {
  const before = onWater(camera, from, start.up_m);
  const after = onWater(camera, to, start.up_m);
  return before === null || after === null
    ? start
    : movedBy(start, after[0] - before[0], after[1] - before[1]);
}

function turned(camera: Camera, start: LocalBox, from: Point, to: Point): LocalBox {
  const before = onWater(camera, from, start.up_m);
  const after = onWater(camera, to, start.up_m);
  if (before === null || after === null) {
    return start;
  }
  const bearing = ([east, north]: Vec3): number =>
    (Math.atan2(east - start.east_m, north - start.north_m) * 180) / Math.PI;
  return turnedTo(start, start.heading_deg + turnBetween(bearing(before), bearing(after)));
}

function stretchedFace(
  camera: Camera,
  start: LocalBox,
  handle: "bow" | "stern" | "port" | "starboard",
  dimension: "length_m" | "width_m",
  from: Point,
  to: Point,
): LocalBox {
  const side = handle === "bow" || handle === "port" ? 1 : -1;
  const { forward, port } = axesOf(start);
  const axis = dimension === "length_m" ? forward : port;
  const outward: Vec3 = [side * axis[0], side * axis[1], 0];
  const by = alongAxis(camera, handlePoint(start, handle), outward, from, to);
  return stretched(start, dimension, side, start[dimension] + by);
}

/** How many metres along an axis take a point's pixel from `from` nearest to `to`. */
function alongAxis(camera: Camera, origin: Vec3, axis: Vec3, from: Point, to: Point): number {
  const home = project(camera, origin);
  if (home === null) {
    return 0;
  }
  const target: Point = [home[0] + to[0] - from[0], home[1] + to[1] - from[1]];
  let metres = 0;
  for (let round = 0; round < ROUNDS; round += 1) {
    const here = project(camera, add(origin, scale(axis, metres)));
    const ahead = project(camera, add(origin, scale(axis, metres + 0.01)));
    if (here === null || ahead === null) {
      return metres;
    }
    const slope: Point = [(ahead[0] - here[0]) / 0.01, (ahead[1] - here[1]) / 0.01];
    const steepness = Math.hypot(...slope);
    if (steepness < LEAST_PX_PER_M) {
      return metres;
    }
    const miss: Point = [target[0] - here[0], target[1] - here[1]];
    metres += (miss[0] * slope[0] + miss[1] * slope[1]) / (steepness * steepness);
  }
  return metres;
}
