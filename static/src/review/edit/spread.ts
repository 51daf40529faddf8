/**
 * Where the handles of a box stand on the screen: off the box, outward from its middle, and never so
 * close together that a finger would meet two.
 */
import type { Point } from "../../viewer/view";

export interface Anchor<Name extends string> {
  readonly name: Name;
  /** The point of the box that the handle moves. */
  readonly at: Point;
}

const ROUNDS = 24;

/** Places for handles, `offset` px off their anchors and at least `apart` px from each other. */
export function spread<Name extends string>(
  anchors: readonly Anchor<Name>[],
  middle: Point,
  offset: number,
  apart: number,
): ReadonlyMap<Name, Point> {
  const places = anchors.map(({ at }, index) => {
    const [dx, dy] = [at[0] - middle[0], at[1] - middle[1]];
    const away = Math.hypot(dx, dy);
    // A face seen end on has no outside on the screen: fan such handles out.
    const fan = (2 * Math.PI * index) / anchors.length;
    const [ox, oy] = away < 1 ? [Math.cos(fan), Math.sin(fan)] : [dx / away, dy / away];
    return { x: at[0] + ox * offset, y: at[1] + oy * offset };
  });
  for (let round = 0; round < ROUNDS; round += 1) {
    if (!pushApart(places, apart)) {
      break;
    }
  }
  return new Map(
    anchors.map(({ name, at }, index) => [name, [places[index]?.x ?? at[0], places[index]?.y ?? at[1]]]),
  );
}

/** One round; false when nothing is too close any more. */
function pushApart(places: readonly { x: number; y: number }[], apart: number): boolean {
  let pushed = false;
  places.forEach((a, i) => {
    places.slice(i + 1).forEach((b, offset) => {
      const [dx, dy] = [b.x - a.x, b.y - a.y];
      const distance = Math.hypot(dx, dy);
      if (distance >= apart - 0.01) {
        return;
      }
      const turn = i + offset;
      const [ux, uy] =
        distance < 0.5 ? [Math.cos(turn), Math.sin(turn)] : [dx / distance, dy / distance];
      const push = (apart - distance) / 2;
      a.x -= ux * push;
      a.y -= uy * push;
      b.x += ux * push;
      b.y += uy * push;
      pushed = true;
    });
  });
  return pushed;
}
