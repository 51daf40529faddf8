/** The line above the photograph: where one is, how much is done, one's own count and rate. */
import { duration, number } from "../format";
import { part } from "../page/parts";
import type { Feed } from "./feed";
import type { Pace } from "./pace";
import type { ReviewSession } from "./session";

export class ProgressView {
  constructor(
    private readonly root: HTMLElement,
    private readonly pace: Pace,
  ) {}

  show(session: ReviewSession, feed: Feed): void {
    const { done, total } = session;
    const left = total - done;
    const bar = this.root.querySelector("progress[data-review-progress]");
    if (bar instanceof HTMLProgressElement) {
      bar.max = Math.max(1, total);
      bar.value = done;
    }
    const remaining = this.pace.remainingS(left);
    const forecast = remaining === null || left === 0 ? "" : `, about ${duration(remaining)}`;
    const what = feed.unit === "image" ? "images complete" : "graded";
    part(this.root, "graded").textContent = `${number(done)} of ${number(total)} ${what}`;
    part(this.root, "left").textContent = `${number(left)} left${forecast}`;
    part(this.root, "own").textContent = this.own();
    this.showEnd(session, feed);
  }

  showPlace(session: ReviewSession): void {
    const { number: image, count } = session.imagePosition();
    const what = session.current?.pose === null ? "Whole image" : `Box ${this.boxOf(session)}`;
    part(this.root, "place").textContent = `${what}, image ${number(image)} of ${number(count)}`;
  }

  private boxOf(session: ReviewSession): string {
    const { current } = session;
    const poses = session.posesOfImage(current?.image.id ?? -1);
    const at = poses.findIndex(({ id }) => id === current?.pose?.id) + 1;
    return `${number(at)} of ${number(poses.length)}`;
  }

  private own(): string {
    const seconds = this.pace.secondsPerPose();
    const rate = seconds === null ? "" : `, ${number(60 / Math.max(seconds, 0.1))} a minute`;
    return this.pace.count === 0 ? "" : `You: ${number(this.pace.count)}${rate}`;
  }

  /** What to do when nothing is due: wait for others, or go on elsewhere. */
  private showEnd(session: ReviewSession, feed: Feed): void {
    const { resting } = session;
    const isEmpty = session.stopCount === 0 && feed.state === "drained";
    const end = resting && !isEmpty ? feed.state : "more";
    part(this.root, "end-drained").hidden = end !== "drained";
    part(this.root, "end-waiting").hidden = end !== "waiting";
    this.root.dataset["end"] = resting ? feed.state : "";
  }
}
