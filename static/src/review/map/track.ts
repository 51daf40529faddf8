/** A vessel's way before and after an image (GET /ais/vessels/{mmsi}/track, GeoJSON). */
import { call } from "../../api";
import type { VesselId } from "../../vessel-id";

export interface TrackPoint {
  readonly latDeg: number;
  readonly lonDeg: number;
  readonly timeMs: number;
}

interface Feature {
  readonly geometry: { readonly type: string; readonly coordinates: unknown };
  readonly properties: { readonly times: readonly string[] };
}

/** Minutes before and after the image. */
const AROUND_MIN = 6;

export async function loadTrack(mmsi: VesselId, at: string): Promise<readonly TrackPoint[]> {
  const moment = new Date(at).getTime();
  const query = new URLSearchParams({
    from: new Date(moment - AROUND_MIN * 60_000).toISOString(),
    to: new Date(moment + AROUND_MIN * 60_000).toISOString(),
  });
  const found = await call(`/api/v1/ais/vessels/${mmsi}/track?${query.toString()}`);
  return pointsOf((found as { readonly features: readonly Feature[] }).features);
}

export function pointsOf(features: readonly Feature[]): readonly TrackPoint[] {
  return features.flatMap(({ geometry, properties }) => {
    const places = geometry.type === "Point" ? [geometry.coordinates] : geometry.coordinates;
    return (places as readonly (readonly [number, number])[]).map(([lonDeg, latDeg], i) => ({
      latDeg,
      lonDeg,
      timeMs: new Date(properties.times[i] ?? "").getTime(),
    }));
  });
}

/** Cut at a moment: what had been heard by then, and what came later. */
export function cutAt(
  points: readonly TrackPoint[],
  at: string,
): { readonly before: readonly TrackPoint[]; readonly after: readonly TrackPoint[] } {
  const moment = new Date(at).getTime();
  return {
    before: points.filter(({ timeMs }) => timeMs <= moment),
    after: points.filter(({ timeMs }) => timeMs > moment),
  };
}
