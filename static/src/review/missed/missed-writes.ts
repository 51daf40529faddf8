/** Missed vessels on their way to the server (REST, images of a run). */
import { call } from "../../api";
import type { Rect } from "../../viewer/view";
import type { Scene } from "../stage";
import type { MissedReason, MissedVessel } from "../surroundings";

export interface Pixels {
  readonly x1_px: number;
  readonly y1_px: number;
  readonly x2_px: number;
  readonly y2_px: number;
}

/** A hundredth of a pixel is finer than any hand. */
export function pixelsOf({ x1, y1, x2, y2 }: Rect): Pixels {
  const rounded = (value: number): number => Math.round(value * 100) / 100;
  return { x1_px: rounded(x1), y1_px: rounded(y1), x2_px: rounded(x2), y2_px: rounded(y2) };
}

export function rectOf({ x1_px: x1, y1_px: y1, x2_px: x2, y2_px: y2 }: Pixels): Rect {
  return { x1, y1, x2, y2 };
}

/** The same key stores the same box once, however often it is sent. */
export async function storeMissed(
  { image, runId }: Scene,
  rect: Rect,
  reason: MissedReason,
  idempotencyKey: string,
): Promise<MissedVessel> {
  return (await call(`/api/v1/images/${image.id}/missed-vessels`, {
    method: "POST",
    json: { run_id: runId, ...pixelsOf(rect), reason },
    idempotencyKey,
  })) as MissedVessel;
}

export async function changeMissed(
  { id, version }: MissedVessel,
  changed: Partial<Pixels> & { readonly reason?: MissedReason },
): Promise<MissedVessel> {
  return (await call(`/api/v1/missed-vessels/${id}`, {
    method: "PATCH",
    json: changed,
    ifMatch: version,
  })) as MissedVessel;
}

export async function deleteMissed({ id, version }: MissedVessel): Promise<void> {
  await call(`/api/v1/missed-vessels/${id}`, { method: "DELETE", ifMatch: version });
}
