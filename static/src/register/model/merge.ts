/**
 * Two people edited the same keypoints: what each of them changed since the state both began with.
 *
 * Changes of one side alone are taken. A point that both changed differently is a conflict, and a
 * person decides; until then mine stands.
 */
import { samePoint, type Point, type Points } from "./point";

export type Side = "mine" | "theirs";

export interface Conflict {
  readonly key: string;
  /** Null: removed. */
  readonly mine: Point | null;
  readonly theirs: Point | null;
}

export interface Merge {
  /** What they changed and I did not: taken over. */
  readonly taken: readonly { readonly before: Point | null; readonly after: Point | null }[];
  readonly conflicts: readonly Conflict[];
  resolve(choices: ReadonlyMap<string, Side>): Points;
}

export function merge(base: Points, mine: Points, theirs: Points): Merge {
  const [inBase, inMine, inTheirs] = [byKey(base), byKey(mine), byKey(theirs)];
  const keys = [...new Set([...mine, ...theirs, ...base].map(({ key }) => key))];
  const taken: { before: Point | null; after: Point | null }[] = [];
  const conflicts: Conflict[] = [];
  const fromTheirs = new Set<string>();
  for (const key of keys) {
    const [b, m, t] = [inBase.get(key) ?? null, inMine.get(key) ?? null, inTheirs.get(key) ?? null];
    if (isSame(b, t) || isSame(m, t)) {
      continue;
    }
    if (isSame(b, m)) {
      taken.push({ before: b, after: t });
      fromTheirs.add(key);
    } else {
      conflicts.push({ key, mine: m, theirs: t });
    }
  }
  const resolve = (choices: ReadonlyMap<string, Side>): Points =>
    keys.flatMap((key) => {
      const takesTheirs = fromTheirs.has(key) || choices.get(key) === "theirs";
      const point = (takesTheirs ? inTheirs : inMine).get(key);
      return point === undefined ? [] : [point];
    });
  return { taken, conflicts, resolve };
}

function byKey(points: Points): ReadonlyMap<string, Point> {
  return new Map(points.map((point) => [point.key, point]));
}

function isSame(a: Point | null, b: Point | null): boolean {
  return a === null || b === null ? a === b : samePoint(a, b);
}

/** What happened to a point, in words. */
export function describeChange(before: Point | null, after: Point | null): string {
  if (after === null) {
    return "removed";
  }
  if (before === null) {
    return "added";
  }
  const parts = [];
  if (before.name !== after.name) {
    parts.push(`renamed to ${after.name}`);
  }
  if (before.pixel?.[0] !== after.pixel?.[0] || before.pixel?.[1] !== after.pixel?.[1]) {
    parts.push(`pixel ${pixelText(before)} → ${pixelText(after)}`);
  }
  if (!isSame({ ...before, pixel: null, role: "off", name: "" }, { ...after, pixel: null, role: "off", name: "" })) {
    parts.push("place moved");
  }
  if (before.role !== after.role) {
    parts.push(`role ${before.role} → ${after.role}`);
  }
  return parts.join(", ");
}

function pixelText({ pixel }: Point): string {
  return pixel === null ? "none" : `(${pixel[0].toFixed(1)}, ${pixel[1].toFixed(1)})`;
}
