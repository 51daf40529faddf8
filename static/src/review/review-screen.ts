/**
 * What the review page shows: joins session, viewer, panel and strip. Every act of the reviewer
 * changes the session first and then what is shown; nothing waits for the network.
 */
import { duration, number } from "../format";
import { part } from "../page/parts";
import type { Viewer } from "../viewer/viewer";
import { ReviewActs } from "./acts";
import { DecisionStrip } from "./decision-strip";
import { announcement } from "./facts-panel";
import type { Action } from "./keymap";
import { ModeMachine, type Mode } from "./modes";
import { Pace } from "./pace";
import type { Grade, Pose } from "./pose";
import { prefetch } from "./prefetch";
import type { ReviewSession } from "./session";
import { Stopwatch } from "./stopwatch";

const REVIEWING: Mode = {
  name: "review",
  title: "",
  hint: "",
  commands: [],
  enter: () => true,
  leave: () => undefined,
  act: () => undefined,
};

export class ReviewScreen {
  readonly machine = new ModeMachine(REVIEWING);
  private readonly acts: ReviewActs;
  private readonly strip: DecisionStrip;
  private readonly stopwatch = new Stopwatch();
  private readonly pace = new Pace();
  private shownId: number | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly runId: number,
    private readonly session: ReviewSession,
    private readonly onGrade: (pose: Pose, grade: Grade, seconds: number) => void,
  ) {
    this.acts = new ReviewActs(root, this.machine, {
      onSelect: (id) => {
        this.goTo(id);
      },
      onPoseChanged: (pose) => {
        this.session.put(pose);
        this.show();
      },
    });
    this.strip = new DecisionStrip(part(root, "strip"), (id) => {
      this.goTo(id);
    });
  }

  get viewer(): Viewer {
    return this.acts.viewer;
  }

  act(action: Action): void {
    switch (action.kind) {
      case "grade":
        this.grade(action.grade);
        return;
      case "box":
        this.session.step(action.by);
        break;
      case "image":
        this.session.stepImage(action.by);
        break;
      case "next-ungraded":
        this.session.toNextUngraded();
        break;
      case "back":
        this.session.back();
        break;
      case "framing":
        this.viewer.setFraming(this.viewer.framing === "object" ? "image" : "object");
        return;
      case "layers":
        this.acts.layers.toggle();
        return;
      case "help":
        this.openHelp();
        return;
      case "peek":
        return; // lasts while the key is down: setPeek
    }
    this.show();
  }

  setPeek(peeking: boolean): void {
    this.acts.setPeek(peeking);
  }

  /** Brings the page up to date with the session. */
  show(): void {
    const pose = this.session.current;
    this.showProgress();
    this.strip.show(this.session);
    if (pose === null) {
      return;
    }
    const grade = this.session.gradeOf(pose.id);
    this.acts.show({
      runId: this.runId,
      image: pose.image,
      poses: this.session.posesOfImage(pose.image.id),
      pose,
      grade,
    });
    this.markGrade(grade);
    this.showPlace();
    if (this.shownId === pose.id) {
      return;
    }
    this.shownId = pose.id;
    this.showAddress(pose);
    const { index, total } = this.session;
    part(this.root, "announcement").textContent = announcement(pose, grade, index, total);
    this.stopwatch.restart();
    prefetch(this.session, this.viewer);
  }

  private showAddress(pose: Pose): void {
    const url = new URL(location.href);
    url.searchParams.set("pose", String(pose.id));
    history.replaceState(null, "", url);
  }

  private grade(grade: Grade): void {
    const seconds = this.stopwatch.seconds();
    const pose = this.session.grade(grade);
    if (pose === null) {
      return;
    }
    this.pace.add(seconds);
    this.onGrade(pose, grade, seconds);
    this.show();
  }

  private goTo(poseId: number): void {
    this.session.goTo(poseId);
    this.show();
  }

  private markGrade(grade: Grade | null): void {
    for (const button of this.root.querySelectorAll<HTMLElement>("[data-grade-button]")) {
      button.setAttribute("aria-pressed", String(button.dataset["grade"] === grade));
    }
  }

  private showPlace(): void {
    const { number: image, count } = this.session.imagePosition();
    const { index, total } = this.session;
    part(this.root, "place").textContent =
      `Pose ${number(index + 1)} of ${number(total)}, image ${number(image)} of ${number(count)}`;
  }

  private showProgress(): void {
    const { graded, total } = this.session;
    const bar = this.root.querySelector("progress[data-review-progress]");
    if (bar instanceof HTMLProgressElement) {
      bar.max = Math.max(1, total);
      bar.value = graded;
    }
    const left = total - graded;
    const remaining = this.pace.remainingS(left);
    const forecast = remaining === null || left === 0 ? "" : `, about ${duration(remaining)}`;
    part(this.root, "graded").textContent = `${number(graded)} of ${number(total)} graded`;
    part(this.root, "left").textContent = `${number(left)} left${forecast}`;
    part(this.root, "finished").hidden = left > 0 || total === 0;
  }

  private openHelp(): void {
    const dialog = document.getElementById("review-help");
    if (dialog instanceof HTMLDialogElement) {
      dialog.showModal();
    }
  }
}
