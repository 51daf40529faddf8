/**
 * A reviewer's way through the poses of a run: which one is current, which are graded, what was
 * decided last. Pure state: it knows neither the page nor the network.
 *
 * Poses stand in the order of their images; the poses of one image stand together. A grade given
 * here holds at once (optimistic); should the server refuse it, `withdraw` takes it back.
 */
import type { Grade, Pose } from "./pose";

export interface Decision {
  readonly poseId: number;
  readonly grade: Grade;
}

const STRIP_LENGTH = 10;

export class ReviewSession {
  private readonly poses: Pose[] = [];
  private readonly indexById = new Map<number, number>();
  private readonly grades = new Map<number, Grade>();
  /** Grades as the server has them. */
  private readonly acknowledged = new Map<number, Grade>();
  private readonly decisions: Decision[] = [];
  private at = 0;
  private gradedCount = 0;
  private backSteps = 0;

  /** Adds poses behind those already here; one that is here already is passed over. */
  append(poses: readonly Pose[]): void {
    for (const pose of poses) {
      if (this.indexById.has(pose.id)) {
        continue;
      }
      this.indexById.set(pose.id, this.poses.length);
      this.poses.push(pose);
      // A list asked for before a grade arrived is older than the server's word on that grade.
      const grade = this.acknowledged.get(pose.id) ?? pose.review?.grade;
      if (grade !== undefined && !this.grades.has(pose.id)) {
        this.acknowledged.set(pose.id, grade);
        this.setGrade(pose.id, grade);
      }
    }
  }

  /** A pose as the server has it now; one that is new stands behind the others. */
  put(pose: Pose): void {
    const index = this.indexById.get(pose.id);
    if (index === undefined) {
      this.append([pose]);
    } else {
      this.poses[index] = pose;
    }
  }

  get current(): Pose | null {
    return this.poses[this.at] ?? null;
  }

  get index(): number {
    return this.at;
  }

  get total(): number {
    return this.poses.length;
  }

  get graded(): number {
    return this.gradedCount;
  }

  gradeOf(poseId: number): Grade | null {
    return this.grades.get(poseId) ?? null;
  }

  pose(poseId: number): Pose | null {
    const index = this.indexById.get(poseId);
    return index === undefined ? null : (this.poses[index] ?? null);
  }

  /** The last decisions, newest first, one per pose. */
  get strip(): readonly Decision[] {
    return this.decisions.slice(0, STRIP_LENGTH);
  }

  posesOfImage(imageId: number): readonly Pose[] {
    return this.poses.filter((pose) => pose.image.id === imageId);
  }

  /** Grades the current pose and moves on to the next ungraded one; returns the graded pose. */
  grade(grade: Grade): Pose | null {
    const pose = this.current;
    if (pose === null) {
      return null;
    }
    this.record(pose.id, grade);
    this.toNextUngraded();
    return pose;
  }

  /** A decision made earlier and still on its way to the server, or made elsewhere. */
  restore(poseId: number, grade: Grade): void {
    this.record(poseId, grade);
  }

  /** The server has stored a grade. */
  acknowledge(poseId: number, grade: Grade): void {
    this.acknowledged.set(poseId, grade);
  }

  /** Takes back a grade that the server refused; what the server last knew holds again. */
  withdraw(poseId: number): void {
    const known = this.acknowledged.get(poseId);
    this.forget(poseId);
    if (known === undefined) {
      if (this.grades.delete(poseId)) {
        this.gradedCount -= 1;
      }
    } else {
      this.setGrade(poseId, known);
    }
  }

  /** Goes back to the pose decided last, to grade it again; each further call goes one earlier. */
  back(): Pose | null {
    let target = this.decisions[this.backSteps];
    if (target !== undefined && target.poseId === this.current?.id) {
      this.backSteps += 1;
      target = this.decisions[this.backSteps];
    }
    if (target === undefined) {
      return null;
    }
    const steps = this.backSteps + 1;
    const pose = this.goTo(target.poseId);
    this.backSteps = steps;
    return pose;
  }

  goTo(poseId: number): Pose | null {
    const index = this.indexById.get(poseId);
    if (index === undefined) {
      return null;
    }
    this.at = index;
    this.backSteps = 0;
    return this.current;
  }

  /** The next or previous box, over the borders of images; stays at the ends. */
  step(by: 1 | -1): void {
    this.at = Math.max(0, Math.min(this.poses.length - 1, this.at + by));
  }

  /** The first box of the next or previous image; stays when there is none. */
  stepImage(by: 1 | -1): void {
    const imageId = this.current?.image.id;
    let index = this.at;
    while (this.poses[index]?.image.id === imageId && index >= 0 && index < this.poses.length) {
      index += by;
    }
    const target = this.poses[index];
    if (target !== undefined) {
      this.at = this.poses.findIndex((pose) => pose.image.id === target.image.id);
    }
  }

  /** Moves to the next ungraded pose after the current one, around the end; false if there is none. */
  toNextUngraded(): boolean {
    const next = this.upcoming(1)[0];
    if (next === undefined) {
      return false;
    }
    this.at = this.indexById.get(next.id) ?? this.at;
    return true;
  }

  /** Moves to the first ungraded pose of all; false if there is none here. */
  toFirstUngraded(): boolean {
    const index = this.poses.findIndex((pose) => !this.grades.has(pose.id));
    this.at = Math.max(0, index);
    return index >= 0;
  }

  /** The ungraded poses that will come by themselves, nearest first. */
  upcoming(count: number): readonly Pose[] {
    const found: Pose[] = [];
    for (let ahead = 1; ahead <= this.poses.length && found.length < count; ahead += 1) {
      const pose = this.poses[(this.at + ahead) % this.poses.length];
      if (pose !== undefined && !this.grades.has(pose.id)) {
        found.push(pose);
      }
    }
    return found;
  }

  /** Number of the current image among all, from 1, and how many there are. */
  imagePosition(): { readonly number: number; readonly count: number } {
    const ids = [...new Set(this.poses.map((pose) => pose.image.id))];
    return { number: ids.indexOf(this.current?.image.id ?? -1) + 1, count: ids.length };
  }

  private record(poseId: number, grade: Grade): void {
    this.forget(poseId);
    this.decisions.unshift({ poseId, grade });
    this.backSteps = 0;
    this.setGrade(poseId, grade);
  }

  private forget(poseId: number): void {
    const index = this.decisions.findIndex((decision) => decision.poseId === poseId);
    if (index >= 0) {
      this.decisions.splice(index, 1);
    }
  }

  private setGrade(poseId: number, grade: Grade): void {
    if (!this.grades.has(poseId)) {
      this.gradedCount += 1;
    }
    this.grades.set(poseId, grade);
  }
}
