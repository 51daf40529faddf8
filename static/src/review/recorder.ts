/** Puts a reviewer's acts into the outbox, in the words of the REST interface. */
import type { Outbox } from "./outbox";
import { vesselName, type Grade, type Pose } from "./pose";
import type { PoseImage } from "./session";
import type { Decision, GradeDecision } from "./verdicts";
import type { Effect, PendingWrite, Write } from "./writes";

const API = "/api/v1";

export class Recorder {
  constructor(
    private readonly outbox: Pick<Outbox, "add">,
    private readonly runId: number,
  ) {}

  grade(pose: Pose, grade: Grade, seconds: number): PendingWrite {
    return this.add(pose.image.id, {
      method: "POST",
      url: `${API}/poses/${pose.id}/reviews`,
      json: { grade, reasons: [], comment: null, seconds },
      label: `The grade of ${vesselName(pose)}`,
      effect: { kind: "grade", imageId: pose.image.id, poseIds: [pose.id], grade },
    });
  }

  gradeRest(image: PoseImage, poses: readonly Pose[], seconds: number): PendingWrite {
    const poseIds = poses.map(({ id }) => id);
    return this.add(image.id, {
      method: "POST",
      url: `${API}/images/${image.id}/reviews`,
      json: { run_id: this.runId, grade: "good", pose_ids: poseIds, seconds },
      label: `The grade of ${poses.length} poses`,
      effect: { kind: "grade", imageId: image.id, poseIds, grade: "good" },
    });
  }

  reasons({ id, imageId }: GradeDecision, reasons: readonly string[]): void {
    this.add(imageId, {
      method: "PATCH",
      url: `${API}/decisions/${id}`,
      json: { reasons },
      label: "The reasons",
      effect: { kind: "reasons", decision: id, reasons },
    });
  }

  complete(image: PoseImage): PendingWrite {
    return this.add(image.id, {
      method: "POST",
      url: `${API}/images/${image.id}/complete`,
      json: { run_id: this.runId },
      label: `That image ${image.file_name} is complete`,
      effect: { kind: "complete", imageId: image.id },
    });
  }

  /** Undoes a decision on the server: a grade is withdrawn, an image is open again. */
  withdraw(decision: Decision): void {
    const isGrade = decision.kind === "grade";
    this.add(decision.imageId, {
      method: "DELETE",
      url: isGrade
        ? `${API}/decisions/${decision.id}`
        : `${API}/images/${decision.imageId}/complete?run_id=${this.runId}`,
      label: "The undoing",
      effect: { kind: isGrade ? "withdraw" : "reopen", decision: decision.id },
    });
  }

  bookmark(image: PoseImage, pose: Pose | null, on: boolean): void {
    const path = pose === null ? `images/${image.id}` : `poses/${pose.id}`;
    this.add(image.id, {
      method: on ? "PUT" : "DELETE",
      url: `${API}/${path}/bookmark`,
      label: "The bookmark",
      effect: { kind: "bookmark", key: path, on },
    });
  }

  comment(image: PoseImage, pose: Pose | null, text: string): void {
    const path = pose === null ? `images/${image.id}` : `poses/${pose.id}`;
    this.add(image.id, {
      method: "POST",
      url: `${API}/${path}/comments`,
      json: { text },
      label: "The comment",
      effect: { kind: "other" },
    });
  }

  private add(
    imageId: number,
    write: Omit<Write, "channel" | "runId" | "effect"> & { readonly effect: Effect },
  ): PendingWrite {
    return this.outbox.add({ ...write, channel: `image:${imageId}`, runId: this.runId });
  }
}
