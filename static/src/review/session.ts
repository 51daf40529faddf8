/**
 * A reviewer's way through images and poses: where one stands, what is still to do, what comes next.
 * Pure state: it knows neither the page nor the network.
 *
 * The way is a row of stops: the poses of an image stand together, and behind them the image itself
 * where it has to be closed (is every visible vessel accounted for?) or where it has no pose at all.
 * Some stops are due, the others are there to look at: what somebody else holds, what is judged.
 */
import type { Grade, Pose } from "./pose";
import { Verdicts, type Decision } from "./verdicts";

export type PoseImage = Pose["image"];

export interface Stop {
  readonly key: string;
  readonly image: PoseImage;
  /** Null: the image as a whole. */
  readonly pose: Pose | null;
}

interface Group {
  readonly image: PoseImage;
  /** By id; another array whenever one of them changed. */
  poses: readonly Pose[];
  isStop: boolean;
}

/** One decision as the strip shows it. */
export interface Remembered {
  readonly decision: Decision;
  readonly key: string;
}

const STRIP_LENGTH = 10;

export function keyOf(pose: number): string {
  return `pose:${pose}`;
}

export function keyOfImage(image: number): string {
  return `image:${image}`;
}

export class ReviewSession {
  readonly verdicts = new Verdicts();
  /** Whether several people are meant to judge the same. */
  expectsOpinions = false;
  /** Whether the verdicts of others are kept from the reviewer, so that theirs is their own. */
  isBlind = false;
  private readonly groups = new Map<number, Group>();
  private readonly due = new Set<string>();
  private flat: Stop[] | null = null;
  private indexByKey = new Map<string, number>();
  private at: string | null = null;
  private isResting = false;
  private extent = { unit: "pose", total: 0, doneBefore: 0 };

  /** How many units there are in all, and how many of them were done before the due ones here. */
  setExtent(unit: "pose" | "image", total: number, doneBefore: number): void {
    this.extent = { unit, total, doneBefore };
  }

  /** A decision that the server does not know yet: what it is about was due. */
  count(decision: Decision): void {
    for (const key of keysOf(decision)) {
      this.due.add(key);
    }
  }

  /** Takes poses in; one that is here already is renewed. */
  take(poses: readonly Pose[], isDue: (pose: Pose) => boolean): void {
    for (const pose of poses) {
      const group = this.groupOf(pose.image);
      group.poses = [...group.poses.filter(({ id }) => id !== pose.id), pose].sort(
        (a, b) => a.id - b.id,
      );
      // A list asked for before a grade arrived is older than the decision made here.
      this.verdicts.tell(pose.id, pose.mine ?? (this.isBlind ? null : pose.review));
      if (isDue(pose)) {
        this.verdicts.forgetOld(pose.id);
        this.due.add(keyOf(pose.id));
      }
    }
    this.flat = null;
  }

  /** A pose as the server now has it: corrected, matched anew, or made by hand just now. */
  put(pose: Pose): void {
    const isNew = this.pose(pose.id) === null;
    this.take([pose], ({ review }) => isNew && review === null);
  }

  /** Takes an image in as a stop of its own. */
  takeImage(image: PoseImage, isDue: boolean): void {
    this.groupOf(image).isStop = true;
    if (isDue) {
      this.due.add(keyOfImage(image.id));
    }
    this.flat = null;
  }

  /** Puts the images into the order in which they were taken. */
  sortByTime(): void {
    const sorted = [...this.groups].sort(([, a], [, b]) =>
      a.image.captured_at.localeCompare(b.image.captured_at),
    );
    this.groups.clear();
    for (const [id, group] of sorted) {
      this.groups.set(id, group);
    }
    this.flat = null;
  }

  get current(): Stop | null {
    return this.stops[this.index] ?? null;
  }

  get index(): number {
    return (this.at === null ? undefined : this.indexByKey.get(this.at)) ?? 0;
  }

  get stopCount(): number {
    return this.stops.length;
  }

  get total(): number {
    return this.extent.total;
  }

  get done(): number {
    return Math.min(this.extent.total, this.extent.doneBefore + this.decided);
  }

  /** How many of the due units are done. */
  get decided(): number {
    const units = [...this.due].filter((key) => key.startsWith(this.extent.unit));
    return units.filter((key) => this.isDone(key)).length;
  }

  /** After the last due stop was done: nothing is asked until the reviewer moves by hand. */
  get resting(): boolean {
    return this.isResting;
  }

  has(key: string): boolean {
    return this.stopAt(key) !== null;
  }

  pose(poseId: number): Pose | null {
    return this.stopAt(keyOf(poseId))?.pose ?? null;
  }

  gradeOf(poseId: number): Grade | null {
    return this.verdicts.gradeOf(poseId);
  }

  posesOfImage(imageId: number): readonly Pose[] {
    return this.groups.get(imageId)?.poses ?? [];
  }

  ungradedOfImage(imageId: number): readonly Pose[] {
    return this.posesOfImage(imageId).filter(({ id }) => this.verdicts.gradeOf(id) === null);
  }

  /** The last decisions, newest first; a pose judged twice stands once. */
  get strip(): readonly Remembered[] {
    const seen = new Set<string>();
    const entries: Remembered[] = [];
    for (const decision of this.verdicts.history.toReversed()) {
      const key =
        decision.kind === "grade" ? keyOf(decision.poseIds[0] ?? 0) : keyOfImage(decision.imageId);
      if (!seen.has(key) && entries.length < STRIP_LENGTH) {
        entries.push({ decision, key });
      }
      seen.add(key);
    }
    return entries;
  }

  /** A decision about what is shown; the next due stop comes by itself. */
  decide(decision: Decision): void {
    this.verdicts.decide(decision);
    this.isResting = !this.toNextDue();
  }

  /** Takes a decision back and returns to it; what it was about is to be done again. */
  withdraw(id: string): Decision | null {
    const decision = this.verdicts.withdraw(id);
    if (decision === null) {
      return null;
    }
    this.count(decision);
    return decision;
  }

  goTo(key: string): boolean {
    if (!this.has(key)) {
      return false;
    }
    this.at = key;
    this.isResting = false;
    return true;
  }

  /** The next or previous stop, over the borders of images; stays at the ends. */
  step(by: 1 | -1): void {
    this.moveTo(this.index + by);
  }

  /** The first stop of the next or previous image; stays when there is none. */
  stepImage(by: 1 | -1): void {
    const imageId = this.current?.image.id;
    let index = this.index;
    while (this.stops[index]?.image.id === imageId && index >= 0 && index < this.stops.length) {
      index += by;
    }
    const target = this.stops[index]?.image.id;
    if (target !== undefined) {
      this.moveTo(this.stops.findIndex(({ image }) => image.id === target));
    }
  }

  /** Moves to the next due stop after the current one, around the end; false if there is none. */
  toNextDue(): boolean {
    const next = this.upcoming(1)[0];
    return next !== undefined && this.goTo(next.key);
  }

  /** Moves to the first due stop of all; false if there is none here. */
  toFirstDue(): boolean {
    const first = this.stops.find(({ key }) => this.isOpen(key));
    this.isResting = first === undefined;
    return first !== undefined && this.goTo(first.key);
  }

  /** The due stops that will come by themselves, nearest first. */
  upcoming(count: number): readonly Stop[] {
    const found: Stop[] = [];
    const { stops, index } = this;
    for (let ahead = 1; ahead <= stops.length && found.length < count; ahead += 1) {
      const stop = stops[(index + ahead) % stops.length];
      if (stop !== undefined && this.isOpen(stop.key)) {
        found.push(stop);
      }
    }
    return found;
  }

  /** Whether a stop is due and not done. */
  isOpen(key: string): boolean {
    return this.due.has(key) && !this.isDone(key);
  }

  /** Number of the current image among all, from 1, and how many there are. */
  imagePosition(): { readonly number: number; readonly count: number } {
    const ids = [...this.groups.keys()];
    return { number: ids.indexOf(this.current?.image.id ?? -1) + 1, count: ids.length };
  }

  private get stops(): readonly Stop[] {
    if (this.flat === null) {
      this.flat = [...this.groups.values()].flatMap(stopsOf);
      this.indexByKey = new Map(this.flat.map(({ key }, i) => [key, i]));
      this.at ??= this.flat[0]?.key ?? null;
    }
    return this.flat;
  }

  private stopAt(key: string): Stop | null {
    const { stops } = this;
    return stops[this.indexByKey.get(key) ?? -1] ?? null;
  }

  private isDone(key: string): boolean {
    const [kind, id] = key.split(":");
    return kind === "pose"
      ? this.verdicts.isDecided(Number(id))
      : this.verdicts.isComplete(Number(id));
  }

  private moveTo(index: number): void {
    const target = this.stops[Math.max(0, Math.min(this.stops.length - 1, index))];
    if (target !== undefined) {
      this.goTo(target.key);
    }
  }

  private groupOf(image: PoseImage): Group {
    const group = this.groups.get(image.id) ?? { image, poses: [], isStop: false };
    this.groups.set(image.id, group);
    return group;
  }
}

/** The stops that a decision is about. */
function keysOf(decision: Decision): readonly string[] {
  return decision.kind === "grade"
    ? decision.poseIds.map(keyOf)
    : [keyOfImage(decision.imageId)];
}

function stopsOf({ image, poses, isStop }: Group): readonly Stop[] {
  const stops: Stop[] = poses.map((pose) => ({ key: keyOf(pose.id), image, pose }));
  return isStop ? [...stops, { key: keyOfImage(image.id), image, pose: null }] : stops;
}
