/**
 * What holds for each pose: the reviewer's own decisions of this sitting on top of what the server
 * told. A decision can be withdrawn, and then what was below it holds again, as on a stack.
 */
import type { Grade } from "./pose";

/** One key press that judged: usually one pose, with "the rest is Good" several as one. */
export interface GradeDecision {
  readonly kind: "grade";
  /** Its name, here and at the server: the idempotency key it was sent under. */
  readonly id: string;
  readonly imageId: number;
  readonly poseIds: readonly number[];
  readonly grade: Grade;
  readonly reasons: readonly string[];
}

/** The word that every visible vessel of an image is accounted for. */
export interface CompleteDecision {
  readonly kind: "complete";
  readonly id: string;
  readonly imageId: number;
}

export type Decision = GradeDecision | CompleteDecision;

/** The verdict that the server has. */
export interface Told {
  readonly grade: Grade;
  readonly decision?: string | null;
}

export class Verdicts {
  private readonly told = new Map<number, Told>();
  private readonly withdrawn = new Set<string>();
  /** Made before this page was opened. */
  private readonly old = new Set<string>();
  private readonly toldComplete = new Set<number>();
  private readonly byPose = new Map<number, GradeDecision[]>();
  private made: Decision[] = [];

  /** All decisions that hold, oldest first. */
  get history(): readonly Decision[] {
    return this.made;
  }

  get last(): Decision | null {
    return this.made.at(-1) ?? null;
  }

  gradeOf(poseId: number): Grade | null {
    return this.byPose.get(poseId)?.at(-1)?.grade ?? this.toldGrade(poseId);
  }

  /** Whether the reviewer has judged this pose in this sitting. */
  isDecided(poseId: number): boolean {
    return (this.byPose.get(poseId)?.length ?? 0) > 0;
  }

  isComplete(imageId: number): boolean {
    return this.toldComplete.has(imageId) || this.isCompletedHere(imageId);
  }

  isCompletedHere(imageId: number): boolean {
    return this.made.some((one) => one.kind === "complete" && one.imageId === imageId);
  }

  /** What the server has; decisions made here stay on top of it. */
  tell(poseId: number, told: Told | null): void {
    if (told === null) {
      this.told.delete(poseId);
    } else {
      this.told.set(poseId, told);
    }
  }

  /** The decisions of earlier sittings: to be seen and undone, as long as the server agrees. */
  recall(decisions: readonly Decision[]): void {
    for (const decision of decisions) {
      this.old.add(decision.id);
      this.decide(decision);
    }
  }

  /** The server asks for this pose again: what was remembered of it holds no more. */
  forgetOld(poseId: number): void {
    for (const { id } of this.byPose.get(poseId) ?? []) {
      if (this.old.has(id)) {
        this.withdraw(id);
      }
    }
  }

  tellComplete(imageId: number, complete: boolean): void {
    if (complete) {
      this.toldComplete.add(imageId);
    } else {
      this.toldComplete.delete(imageId);
    }
  }

  decide(decision: Decision): void {
    if (this.made.some(({ id }) => id === decision.id)) {
      this.old.delete(decision.id); // it waits to be sent: surely ours, and surely holding
      return;
    }
    this.made.push(decision);
    if (decision.kind === "grade") {
      for (const poseId of decision.poseIds) {
        this.byPose.set(poseId, [...(this.byPose.get(poseId) ?? []), decision]);
      }
    }
  }

  /** Takes a decision back; null when it is not known here. */
  withdraw(id: string): Decision | null {
    const decision = this.made.find((one) => one.id === id);
    if (decision === undefined) {
      return null;
    }
    this.withdrawn.add(id);
    this.made = this.made.filter((one) => one !== decision);
    if (decision.kind === "complete") {
      this.toldComplete.delete(decision.imageId);
    } else {
      for (const poseId of decision.poseIds) {
        const left = this.byPose.get(poseId)?.filter((one) => one.id !== id) ?? [];
        this.byPose.set(poseId, left);
      }
    }
    return decision;
  }

  /** Gives a decision its reasons; null when it is not known here. */
  amend(id: string, reasons: readonly string[]): GradeDecision | null {
    const old = this.made.find((one) => one.id === id);
    if (old?.kind !== "grade") {
      return null;
    }
    const amended = { ...old, reasons };
    this.made = this.made.map((one) => (one.id === id ? amended : one));
    for (const poseId of old.poseIds) {
      const stack = this.byPose.get(poseId) ?? [];
      this.byPose.set(poseId, stack.map((one) => (one.id === id ? amended : one)));
    }
    return amended;
  }

  private toldGrade(poseId: number): Grade | null {
    const told = this.told.get(poseId);
    const isUndone = this.withdrawn.has(told?.decision ?? "");
    return told === undefined || isUndone ? null : told.grade;
  }
}
