/**
 * What lies around the poses of an image: the run's camera, the vessels known from AIS, detections
 * without a pose, and vessels that people marked as missed.
 *
 * It is asked for only once an image has been looked at for a moment, so that it never takes the
 * network from the next photograph; what came is kept for when the image is looked at again.
 */
import { call } from "../api";
import type { components } from "../api-types";
import type { Camera } from "../geometry/camera";
import { cameraOf } from "./edit/edit-view";

type Schemas = components["schemas"];
export type RunCamera = Schemas["RunCameraOut"];
export type KnownVessel = Schemas["VesselAtImage"];
export type FoundBox = Schemas["DetectionOut"];
export type MissedReason = Schemas["MissedReason"];
export type MissedVessel = Schemas["MissedOut"];

export const MISSED_REASONS: readonly MissedReason[] = [
  "not_detected",
  "no_ais",
  "neither",
  "cost_too_high",
];

export interface Surroundings {
  readonly vessels: readonly KnownVessel[];
  readonly detections: readonly FoundBox[];
  readonly missed: readonly MissedVessel[];
}

export const NOTHING_AROUND: Surroundings = { vessels: [], detections: [], missed: [] };

interface Items<T> {
  readonly items: readonly T[];
}

export class SurroundingsStore {
  private readonly known = new Map<number, Surroundings>();
  private cameraPromise: Promise<RunCamera> | null = null;

  constructor(private readonly runId: number) {}

  /** The camera of the run; asked for once. */
  camera(): Promise<RunCamera> {
    this.cameraPromise ??= call(`/api/v1/runs/${this.runId}/camera`).then(
      (answer) => answer as RunCamera,
      (error: unknown) => {
        this.cameraPromise = null; // the next one tries again
        throw error;
      },
    );
    return this.cameraPromise;
  }

  /** What is known already. */
  of(imageId: number): Surroundings | null {
    return this.known.get(imageId) ?? null;
  }

  async load(imageId: number, signal?: AbortSignal): Promise<Surroundings> {
    const list = async <T>(what: string): Promise<readonly T[]> => {
      const url = `/api/v1/images/${imageId}/${what}?run_id=${this.runId}&limit=200`;
      return ((await call(url, signal === undefined ? {} : { signal })) as Items<T>).items;
    };
    const [vessels, detections, missed] = await Promise.all([
      list<KnownVessel>("vessels"),
      list<FoundBox>("detections"),
      list<MissedVessel>("missed-vessels"),
    ]);
    const found = { vessels, detections, missed };
    this.known.set(imageId, found);
    return found;
  }

  /** Takes what a person just did, before the server is asked again. */
  change(imageId: number, changed: Partial<Surroundings>): Surroundings {
    const next = { ...(this.known.get(imageId) ?? NOTHING_AROUND), ...changed };
    this.known.set(imageId, next);
    return next;
  }
}

/** The camera in the site's east-north-up frame. */
export function worldCamera(given: RunCamera): Camera {
  return cameraOf({
    ...given,
    R_cam_from_local: given.R_cam_from_enu,
    center_in_local_m: given.center_in_enu_m,
  });
}
