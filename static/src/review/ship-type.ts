/** The AIS ship type in words (ITU-R M.1371-5, table 53). */
const EXACT: ReadonlyMap<number, string> = new Map([
  [30, "Fishing vessel"],
  [31, "Towing"],
  [32, "Towing, long or wide"],
  [33, "Dredging or underwater work"],
  [34, "Diving"],
  [35, "Military"],
  [36, "Sailing vessel"],
  [37, "Pleasure craft"],
  [50, "Pilot vessel"],
  [51, "Search and rescue"],
  [52, "Tug"],
  [53, "Port tender"],
  [54, "Anti-pollution"],
  [55, "Law enforcement"],
  [58, "Medical transport"],
]);

const BY_TENS: ReadonlyMap<number, string> = new Map([
  [2, "Wing in ground"],
  [4, "High-speed craft"],
  [6, "Passenger ship"],
  [7, "Cargo ship"],
  [8, "Tanker"],
  [9, "Other type"],
]);

/** Null where the vessel does not say what it is. */
export function shipType(code: number | null): string | null {
  if (code === null) {
    return null;
  }
  return EXACT.get(code) ?? BY_TENS.get(Math.floor(code / 10)) ?? null;
}
