/**
 * What the review page does and shows: joins the way through the stops, the stage, the panel of
 * decisions and the outbox. Every act of the reviewer changes the session first and then what is
 * shown; nothing waits for the network.
 */
import { openDialog } from "../page/dialogs";
import { showFlash } from "../page/flashes";
import { part } from "../page/parts";
import type { Viewer } from "../viewer/viewer";
import { ReviewActs } from "./acts";
import { Bookmarks } from "./bookmarks";
import { CommentBox } from "./comment-box";
import { GRADE_COMMANDS, REVIEW_COMMANDS } from "./commands";
import { DecisionStrip } from "./decision-strip";
import { announcement } from "./facts-panel";
import { posesOfImage, type Feed } from "./feed";
import type { Keymap } from "./keymap";
import type { LiveFigures } from "./live-figures";
import { ModeMachine } from "./modes";
import { Pace } from "./pace";
import { vesselName, type Grade } from "./pose";
import { loadPose } from "./pose-loader";
import { prefetch } from "./prefetch";
import { ProgressView } from "./progress-view";
import { ReasonsMode } from "./reasons";
import type { Recorder } from "./recorder";
import type { RememberedDecisions } from "./remembered";
import { keyOf, keyOfImage, type PoseImage, type ReviewSession } from "./session";
import { Stopwatch } from "./stopwatch";
import type { Decision, GradeDecision } from "./verdicts";

export interface ScreenParts {
  readonly runId: number;
  readonly session: ReviewSession;
  readonly feed: Feed;
  readonly recorder: Recorder;
  readonly keymap: Keymap;
  readonly remembered: RememberedDecisions;
  readonly figures: LiveFigures;
  readonly openHelp: () => void;
}

export class ReviewScreen {
  readonly machine: ModeMachine;
  private readonly acts: ReviewActs;
  private readonly strip: DecisionStrip;
  private readonly reasons: ReasonsMode;
  private readonly comments: CommentBox;
  private readonly stopwatch = new Stopwatch();
  private readonly pace = new Pace();
  private readonly progress: ProgressView;
  private readonly bookmarks: Bookmarks;
  /** Images whose other poses were asked for. */
  private readonly peopled = new Set<number>();
  private shownKey: string | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly parts: ScreenParts,
  ) {
    this.machine = new ModeMachine({
      name: "review",
      title: "",
      hint: "",
      commands: REVIEW_COMMANDS,
      enter: () => true,
      leave: () => undefined,
      act: (id) => {
        this.act(id);
      },
    });
    this.bookmarks = new Bookmarks(parts.session);
    this.progress = new ProgressView(root, this.pace);
    this.reasons = new ReasonsMode(root, this.machine, parts.keymap, (decision, reasons) => {
      this.amend(decision, reasons);
    });
    this.machine.add(this.reasons);
    this.acts = new ReviewActs(root, this.machine, {
      onSelect: (id) => {
        this.open(keyOf(id));
      },
      onPoseChanged: (pose) => {
        parts.session.put(pose);
        this.show();
      },
    });
    this.strip = new DecisionStrip(part(root, "strip"), (key) => {
      this.open(key);
    });
    this.comments = new CommentBox(document, ({ image, pose }, text) => {
      parts.recorder.comment(image, pose, text);
    });
  }

  get viewer(): Viewer {
    return this.acts.viewer;
  }

  act(command: string): void {
    const { session } = this.parts;
    const grade = GRADE_COMMANDS.get(command);
    if (grade !== undefined) {
      this.grade(grade);
      return;
    }
    switch (command) {
      case "review.next-box":
        session.step(1);
        break;
      case "review.previous-box":
        session.step(-1);
        break;
      case "review.next-image":
        session.stepImage(1);
        break;
      case "review.previous-image":
        session.stepImage(-1);
        break;
      case "review.next-ungraded":
        session.toNextDue();
        break;
      case "review.fit":
        this.viewer.setFraming(this.viewer.framing === "object" ? "image" : "object");
        return;
      default:
        this.actOnce(command);
        return;
    }
    this.show();
  }

  setPeek(peeking: boolean): void {
    this.acts.setPeek(peeking);
  }

  /** Goes to a pose or an image; one that is not here yet is fetched. */
  open(key: string): void {
    if (this.parts.session.goTo(key)) {
      this.show();
      return;
    }
    const [kind, id] = key.split(":");
    if (kind === "pose") {
      loadPose(Number(id)).then(
        (pose) => {
          this.parts.session.take([pose], () => false);
          this.parts.session.goTo(key);
          this.show();
        },
        () => {
          showFlash("That pose is not there any more.", "info");
        },
      );
    }
  }

  /** More has come: whoever waited for it goes on with it. */
  more(): void {
    const { session } = this.parts;
    if (session.resting) {
      session.toNextDue();
    }
    this.show();
  }

  /** Brings the page up to date with the session. */
  show(): void {
    const { session, feed } = this.parts;
    const stop = session.current;
    this.progress.show(session, feed);
    this.strip.show(session);
    if (stop === null) {
      return;
    }
    const { image, pose } = stop;
    const grade = pose === null ? null : session.gradeOf(pose.id);
    const poses = session.posesOfImage(image.id);
    this.acts.show({ runId: this.parts.runId, image, poses, pose, grade });
    this.markButtons(grade);
    this.progress.showPlace(session);
    if (this.shownKey === stop.key) {
      return;
    }
    this.shownKey = stop.key;
    this.showAddress();
    this.announce();
    this.stopwatch.restart();
    this.bringOthers(image);
    feed.moved();
    prefetch(session, this.viewer);
  }

  /** What is not about the way: each of these shows its own consequences. */
  private actOnce(command: string): void {
    switch (command) {
      case "review.rest-good":
        this.gradeRest();
        break;
      case "review.undo":
        this.undo();
        break;
      case "review.complete":
        this.complete();
        break;
      case "review.layers":
        this.acts.layers.toggle();
        break;
      case "review.missed":
        this.machine.enter("missed");
        break;
      case "review.edit":
        this.machine.enter("edit");
        break;
      case "review.rematch":
        this.machine.enter("rematch");
        break;
      case "review.bookmark":
        this.bookmark();
        break;
      case "review.comment":
        if (this.parts.session.current !== null) {
          this.comments.open(this.parts.session.current);
        }
        break;
      case "review.figures":
        this.parts.figures.toggle();
        break;
      case "review.guideline":
        openDialog(document, "review-guideline");
        break;
      case "review.help":
        this.parts.openHelp();
        break;
    }
  }

  private grade(grade: Grade): void {
    const { session, recorder } = this.parts;
    const pose = session.current?.pose ?? null;
    if (pose === null || session.resting) {
      return;
    }
    const seconds = this.stopwatch.seconds();
    const { key } = recorder.grade(pose, grade, seconds);
    const decision: GradeDecision = {
      kind: "grade",
      id: key,
      imageId: pose.image.id,
      poseIds: [pose.id],
      grade,
      reasons: [],
    };
    this.decided(decision, seconds);
    this.reasons.offer(decision, vesselName(pose));
  }

  private gradeRest(): void {
    const { session, recorder } = this.parts;
    const image = session.current?.image;
    const poses = image === undefined ? [] : session.ungradedOfImage(image.id);
    if (image === undefined || poses.length === 0) {
      return;
    }
    const seconds = this.stopwatch.seconds();
    const { key } = recorder.gradeRest(image, poses, seconds);
    const poseIds = poses.map(({ id }) => id);
    this.reasons.close();
    this.decided(
      { kind: "grade", id: key, imageId: image.id, poseIds, grade: "good", reasons: [] },
      seconds,
    );
  }

  private complete(): void {
    const { session, recorder } = this.parts;
    const image = session.current?.image;
    if (image === undefined) {
      return;
    }
    const missing = session.ungradedOfImage(image.id);
    if (missing.length > 0) {
      const poses = missing.length === 1 ? "1 pose is" : `${missing.length} poses are`;
      this.say(`Not complete yet: ${poses} not graded.`);
      this.open(keyOf(missing[0]?.id ?? 0));
      return;
    }
    if (session.verdicts.isComplete(image.id)) {
      this.say("This image is complete already.");
      return;
    }
    const { key } = recorder.complete(image);
    session.takeImage(image, false);
    this.reasons.close();
    this.say("Image complete.");
    this.decided({ kind: "complete", id: key, imageId: image.id }, this.stopwatch.seconds());
  }

  private decided(decision: Decision, seconds: number): void {
    this.parts.session.decide(decision);
    this.pace.add(seconds);
    this.parts.remembered.keep(this.parts.session.strip);
    this.show();
  }

  /** Takes the last decision back, on the server too, and shows what it was about. */
  private undo(): void {
    const { session, recorder, remembered } = this.parts;
    const { last } = session.verdicts;
    if (last === null) {
      this.say("There is nothing to undo.");
      return;
    }
    const key = last.kind === "grade" ? keyOf(last.poseIds[0] ?? 0) : keyOfImage(last.imageId);
    recorder.withdraw(last);
    session.withdraw(last.id);
    remembered.keep(session.strip);
    this.reasons.close();
    this.pace.takeBack();
    this.shownKey = null;
    this.open(key);
    this.say("Undone.");
  }

  private amend(decision: GradeDecision, reasons: readonly string[]): void {
    const { session, recorder, remembered } = this.parts;
    session.verdicts.amend(decision.id, reasons);
    recorder.reasons(decision, reasons);
    remembered.keep(session.strip);
    this.strip.show(session);
  }

  private bookmark(): void {
    const stop = this.parts.session.current;
    if (stop !== null) {
      const on = this.bookmarks.toggle(stop);
      this.parts.recorder.bookmark(stop.image, stop.pose, on);
      this.say(on ? "Bookmarked." : "Bookmark taken away.");
      this.show();
    }
  }

  /** The other poses of the image, which may be somebody else's to judge. */
  private bringOthers(image: PoseImage): void {
    const { session, runId } = this.parts;
    if (this.peopled.has(image.id)) {
      return;
    }
    this.peopled.add(image.id);
    posesOfImage(runId, image).then(
      (poses) => {
        session.take(
          poses.filter(({ id }) => session.pose(id) === null),
          () => false,
        );
        this.show();
      },
      () => {
        this.peopled.delete(image.id); // asked for again when the image comes back
      },
    );
  }

  private markButtons(grade: Grade | null): void {
    const { current, resting } = this.parts.session;
    for (const button of this.root.querySelectorAll<HTMLButtonElement>("[data-grade-button]")) {
      button.setAttribute("aria-pressed", String(button.dataset["grade"] === grade));
      button.disabled = (current?.pose ?? null) === null || resting;
    }
    const bookmarked = current !== null && this.bookmarks.has(current);
    for (const button of this.root.querySelectorAll("[data-act='review.bookmark']")) {
      button.setAttribute("aria-pressed", String(bookmarked));
    }
  }

  private showAddress(): void {
    const url = new URL(location.href);
    const pose = this.parts.session.current?.pose ?? null;
    if (url.searchParams.has("pose") && pose !== null) {
      url.searchParams.set("pose", String(pose.id));
      history.replaceState(null, "", url);
    }
  }

  private announce(): void {
    const { session } = this.parts;
    const { current, index, stopCount: count } = session;
    const pose = current?.pose ?? null;
    if (pose !== null) {
      this.say(announcement(pose, session.gradeOf(pose.id), index, count));
    } else if (current !== null) {
      this.say(`Whole image ${current.image.file_name}. Is every visible vessel accounted for?`);
    }
  }

  private say(text: string): void {
    part(this.root, "announcement").textContent = text;
  }
}
