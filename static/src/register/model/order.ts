/**
 * The order of the table and of the key N: worst first, by the error to trust. Incomplete points
 * come before all, because they wait for a person; points without an error come last.
 */
import { isComplete, type Point } from "./point";

export interface Errors {
  readonly errorPx: number | null;
  readonly leaveOneOutPx: number | null;
}

export const COLUMNS = ["name", "u", "v", "lat", "lon", "height", "role", "error", "loo"] as const;
export type Column = (typeof COLUMNS)[number];

export interface Sorting {
  readonly column: Column;
  readonly descending: boolean;
}

export const WORST_FIRST: Sorting = { column: "loo", descending: true };

export function sorted(
  points: readonly Point[],
  errors: ReadonlyMap<string, Errors>,
  sorting: Sorting,
): Point[] {
  const direction = sorting.descending ? -1 : 1;
  return [...points].sort((a, b) => {
    const waiting = Number(isComplete(a)) - Number(isComplete(b));
    if (waiting !== 0) {
      return waiting;
    }
    const [x, y] = [valueOf(a, errors, sorting.column), valueOf(b, errors, sorting.column)];
    if (x === null || y === null) {
      return Number(x === null) - Number(y === null);
    }
    const by =
      typeof x === "string" || typeof y === "string"
        ? String(x).localeCompare(String(y), "en", { numeric: true })
        : x - y;
    return by * direction || a.name.localeCompare(b.name, "en", { numeric: true });
  });
}

/** The error by which a point is judged: leave-one-out where there is one. */
export function judgedBy(errors: Errors | undefined): number | null {
  return errors?.leaveOneOutPx ?? errors?.errorPx ?? null;
}

function valueOf(
  point: Point,
  errors: ReadonlyMap<string, Errors>,
  column: Column,
): number | string | null {
  const own = errors.get(point.key);
  switch (column) {
    case "name":
      return point.name;
    case "u":
      return point.pixel?.[0] ?? null;
    case "v":
      return point.pixel?.[1] ?? null;
    case "lat":
      return point.place?.latDeg ?? null;
    case "lon":
      return point.place?.lonDeg ?? null;
    case "height":
      return point.place?.heightM ?? null;
    case "role":
      return point.role;
    case "error":
      return own?.errorPx ?? null;
    case "loo":
      return judgedBy(own);
  }
}

/** The next worst after the selected point; from the best on it starts again with the worst. */
export function nextWorst(
  points: readonly Point[],
  errors: ReadonlyMap<string, Errors>,
  selected: string | null,
): Point | null {
  const ranked = sorted(points, errors, WORST_FIRST).filter(({ role }) => role !== "off");
  const place = ranked.findIndex(({ key }) => key === selected);
  return ranked[(place + 1) % Math.max(1, ranked.length)] ?? null;
}
