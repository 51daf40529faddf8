/** What a mode finds on the page: the photograph, what stands on it now, and whom to tell. */
import type { Viewer } from "../viewer/viewer";
import type { ModeMachine } from "./modes";
import type { Grade, Pose } from "./pose";
import type { SurroundingsStore } from "./surroundings";

/** What is on the stage. */
export interface Scene {
  readonly runId: number;
  readonly image: Pose["image"];
  /** The run's poses of this image. */
  readonly poses: readonly Pose[];
  /** The pose that is judged now; null for an image without one. */
  readonly pose: Pose | null;
  readonly grade: Grade | null;
}

export interface Stage {
  readonly root: HTMLElement;
  readonly viewer: Viewer;
  readonly machine: ModeMachine;
  readonly around: SurroundingsStore;
  readonly user: string;
  scene(): Scene | null;
  /** A pose as the server now has it: corrected, matched anew, or made by hand. */
  poseChanged(pose: Pose): void;
  /** What lies around the image has changed: draw it anew. */
  surroundingsChanged(): void;
  announce(text: string): void;
}
