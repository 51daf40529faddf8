/** Where the stops of a review come from. */
import { call } from "../api";
import type { Pose, PosePage } from "./pose";
import type { PoseImage } from "./session";

/** What is over when nothing is due any more. */
export type FeedState = "more" | "waiting" | "drained";

export interface Feed {
  /** What is being reviewed, in words. */
  readonly title: string;
  readonly unit: "pose" | "image";
  readonly state: FeedState;
  /** Brings the first stops; resolves once there is something to show, or nothing at all. */
  start(): Promise<void>;
  /** The reviewer moved: brings more when few are left. */
  moved(): void;
  /** All that the reviewer did has reached the server: its count holds. */
  settled(): void;
}

/** All poses of an image within a run, those of others too. */
export async function posesOfImage(runId: number, image: PoseImage): Promise<readonly Pose[]> {
  const query = new URLSearchParams({
    run_id: String(runId),
    image_id: String(image.id),
    limit: "200",
  });
  return ((await call(`/api/v1/poses?${query.toString()}`)) as PosePage).items;
}
