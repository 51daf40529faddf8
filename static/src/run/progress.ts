/** How far a run is, as the server tells it and as people read it. */
import type { components } from "../api-types";
import { duration, number } from "../format";

export type RunProgress = Pick<
  components["schemas"]["RunOut"],
  | "status"
  | "images_done"
  | "images_total"
  | "images_per_s"
  | "remaining_s"
  | "poses"
  | "detections"
>;

const ENDED: ReadonlySet<string> = new Set(["succeeded", "failed", "cancelled"]);

export function hasEnded(status: string): boolean {
  return ENDED.has(status);
}

export function counted(progress: RunProgress): string {
  const { images_done: done, images_total: total, detections, poses } = progress;
  return (
    `${number(done)} of ${number(total)} images, ` +
    `${number(detections)} detections, ${number(poses)} poses`
  );
}

export function pace(progress: RunProgress): string {
  if (progress.status === "queued") {
    return "Waiting for a worker";
  }
  if (hasEnded(progress.status) || progress.images_per_s === null) {
    return "";
  }
  const rate = `${number(progress.images_per_s, 1)} images/s`;
  return progress.remaining_s === null ? rate : `${rate}, ${duration(progress.remaining_s)} left`;
}
