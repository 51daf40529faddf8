/** The state of the map in the page's address, so that a link shows the same again. */

export interface MapState {
  /** Seconds since 1970; null: the last report. */
  readonly momentS: number | null;
  readonly windowS: number;
  /** West, south, east, north, degrees; null: around the site. */
  readonly box: readonly [number, number, number, number] | null;
  /** An MMSI or a pseudonym. */
  readonly vessel: string | null;
  /** Whether the map follows live traffic; the moment is now then. */
  readonly isLive: boolean;
}

export const DEFAULT_WINDOW_S = 1800;
const LONGEST_WINDOW_S = 6 * 3600;

export function readAddress(search: string): MapState {
  const query = new URLSearchParams(search);
  const moment = Date.parse(query.get("t") ?? "");
  const window = Number(query.get("window") ?? DEFAULT_WINDOW_S);
  const box = (query.get("bbox") ?? "").split(",").map(Number);
  const [west = 0, south = 0, east = 0, north = 0] = box;
  const isBox = box.length === 4 && box.every(Number.isFinite) && west < east && south < north;
  return {
    momentS: Number.isNaN(moment) ? null : moment / 1000,
    windowS: window > 0 && window <= LONGEST_WINDOW_S ? window : DEFAULT_WINDOW_S,
    box: isBox ? [west, south, east, north] : null,
    vessel: query.get("vessel") ?? query.get("mmsi"),
    isLive: query.get("live") === "1",
  };
}

export function writeAddress({ momentS, windowS, box, vessel, isLive }: MapState): string {
  const parts: string[] = [];
  if (isLive) {
    parts.push("live=1");
  } else if (momentS !== null) {
    parts.push(`t=${new Date(Math.round(momentS) * 1000).toISOString().replace(".000", "")}`);
  }
  if (windowS !== DEFAULT_WINDOW_S) {
    parts.push(`window=${windowS}`);
  }
  if (box !== null) {
    parts.push(`bbox=${box.map((degrees) => degrees.toFixed(5)).join(",")}`);
  }
  if (vessel !== null) {
    parts.push(`vessel=${encodeURIComponent(vessel)}`);
  }
  return parts.length === 0 ? "" : `?${parts.join("&")}`;
}
