/** Vessels that a detection may show, as the server ranks them, and choosing one of them. */
import { call } from "../../api";
import type { components } from "../../api-types";
import type { Correction } from "../correction";
import type { Pose } from "../pose";
import type { FoundBox } from "../surroundings";
import { idText, type VesselId } from "../../vessel-id";

type Schemas = components["schemas"];
/** `pose_id`: another box that this vessel has already. */
export type Candidate = Schemas["CandidateOut"];
export type Refused = Schemas["RefusedOut"];
type Candidates = Schemas["CandidatesOut"];

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
  mmsi: VesselId,
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
  mmsi: VesselId,
  idempotencyKey: string,
): Promise<Pose> {
  return (await call(`/api/v1/detections/${box.id}/poses`, {
    method: "POST",
    json: { run_id: runId, mmsi },
    idempotencyKey,
  })) as Pose;
}

/** The name a vessel goes by. */
export function nameOf({ name, mmsi }: { name: string | null; mmsi: VesselId }): string {
  const trimmed = name?.trim() ?? "";
  return trimmed === "" ? idText(mmsi) : trimmed;
}
