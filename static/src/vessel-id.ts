/** A vessel as the server tells it: its MMSI, or its pseudonym where one may not see identities. */
export type VesselId = number | string;

export function idText(vessel: VesselId): string {
  return typeof vessel === "number" ? `MMSI ${vessel}` : `Vessel ${vessel}`;
}
