/** Brings the poses of a run page by page, so that work can begin with the first one. */
import { call } from "../api";
import type { Pose, PosePage } from "./pose";

const PAGE_SIZE = 200;

export async function* loadPoses(runId: number): AsyncGenerator<readonly Pose[]> {
  let cursor: string | null = null;
  do {
    const query = new URLSearchParams({ run_id: String(runId), limit: String(PAGE_SIZE) });
    if (cursor !== null) {
      query.set("cursor", cursor);
    }
    const page = (await call(`/api/v1/poses?${query.toString()}`)) as PosePage;
    yield page.items;
    cursor = page.next_cursor ?? null;
  } while (cursor !== null);
}

export async function loadPose(poseId: number): Promise<Pose> {
  return (await call(`/api/v1/poses/${poseId}`)) as Pose;
}
