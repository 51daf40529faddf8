/** Vessels that a detection may show, as the server ranks them, and choosing one of them. */
import { call } from "../../api";
import type { Correction } from "../correction";
import type { Pose } from "../pose";
import type { FoundBox } from "../surroundings";

export interface Candidate {
  readonly mmsi: number;
  readonly name: string | null;
  readonly ship_type: number | null;
  readonly cost: number;
  readonly cost_terms: Pose["cost_terms"];
  readonly length_m: number;
  readonly width_m: number;
  readonly age_s: number;
  /** Another box that this vessel has already. */
  readonly pose_id: number | null;
  readonly current: boolean;
  readonly segment_px: Pose["corners_in_image_px"];
}

export interface Refused {
  readonly mmsi: number;
  readonly name: string | null;
  readonly reason: string;
  readonly text: string;
}

export interface Candidates {
  readonly candidates: readonly Candidate[];
  readonly refused: readonly Refused[];
}

/** What is matched anew: a pose, or a detection that has none. */
export type Target =
  | { readonly kind: "pose"; readonly pose: Pose }
  | { readonly kind: "detection"; readonly box: FoundBox };

export async function loadCandidates(target: Target, runId: number): Promise<Candidates> {
  const url =
    target.kind === "pose"
      ? `/api/v1/poses/${target.pose.id}/candidates`
      : `/api/v1/detections/${target.box.id}/candidates?run_id=${runId}`;
  return (await call(url)) as Candidates;
}

export async function rematchPose(
  pose: Pose,
  mmsi: number,
  version: number,
  idempotencyKey: string,
): Promise<Correction> {
  return (await call(`/api/v1/poses/${pose.id}/rematch`, {
    method: "POST",
    json: { mmsi },
    ifMatch: version,
    idempotencyKey,
  })) as Correction;
}

export async function makePose(
  box: FoundBox,
  runId: number,
  mmsi: number,
  idempotencyKey: string,
): Promise<Pose> {
  return (await call(`/api/v1/detections/${box.id}/poses`, {
    method: "POST",
    json: { run_id: runId, mmsi },
    idempotencyKey,
  })) as Pose;
}

/** The name a vessel goes by. */
export function nameOf({ name, mmsi }: { name: string | null; mmsi: number }): string {
  const trimmed = name?.trim() ?? "";
  return trimmed === "" ? `MMSI ${mmsi}` : trimmed;
}
