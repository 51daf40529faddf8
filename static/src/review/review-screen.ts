/**
 * What the review page shows: joins session, viewer, panel and strip. Every act of the reviewer
 * changes the session first and then what is shown; nothing waits for the network.
 */
import { duration, number } from "../format";
import { part } from "../page/parts";
import type { Framing } from "../viewer/framing";
import { DragPan } from "../viewer/gestures/drag-pan";
import { PinchZoom } from "../viewer/gestures/pinch-zoom";
import { WheelZoom } from "../viewer/gestures/wheel-zoom";
import { PoseOverlay } from "../viewer/overlay/pose-overlay";
import { toImage } from "../viewer/view";
import { Viewer } from "../viewer/viewer";
import { DecisionStrip } from "./decision-strip";
import { announcement, FactsPanel } from "./facts-panel";
import type { Action } from "./keymap";
import { LayersMenu } from "./layers-menu";
import { Pace } from "./pace";
import { drawn, extent, poseAt, vesselName, type Grade, type Pose } from "./pose";
import { prefetch } from "./prefetch";
import type { ReviewSession } from "./session";
import { Stopwatch } from "./stopwatch";

const FRAMING_NAMES: Readonly<Record<Framing, string>> = {
  object: "Fit box",
  image: "Fit image",
  free: "Free view",
};

export class ReviewScreen {
  readonly viewer: Viewer;
  private readonly overlay = new PoseOverlay();
  private readonly panel: FactsPanel;
  private readonly strip: DecisionStrip;
  private readonly layers: LayersMenu;
  private readonly stopwatch = new Stopwatch();
  private readonly pace = new Pace();
  private shownId: number | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly session: ReviewSession,
    private readonly onGrade: (pose: Pose, grade: Grade, seconds: number) => void,
  ) {
    this.viewer = new Viewer(
      part(root, "viewer"),
      (framing) => {
        part(root, "framing").textContent = FRAMING_NAMES[framing];
      },
      (sharpness) => {
        part(root, "note").textContent =
          sharpness === "failed"
            ? "The photograph could not be loaded. Step away and back to try again."
            : "Loading the photograph";
      },
    );
    this.viewer.add(this.overlay);
    new WheelZoom(this.viewer);
    new PinchZoom(this.viewer);
    new DragPan(this.viewer, (at) => {
      const point = toImage(this.viewer.currentView(), at);
      const pose = poseAt(this.posesHere(), point);
      if (pose !== null) {
        this.goTo(pose.id);
      }
    });
    this.panel = new FactsPanel(part(root, "panel"));
    this.strip = new DecisionStrip(part(root, "strip"), (id) => {
      this.goTo(id);
    });
    this.layers = new LayersMenu(
      part(root, "layers"),
      part(root, "layers-opener"),
      (layer, shown) => {
        this.overlay.setLayer(layer, shown);
      },
    );
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
        this.layers.toggle();
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
    this.viewer.setOverlayHidden(peeking);
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
    this.panel.show(pose, grade);
    this.markGrade(grade);
    this.showPlace();
    if (this.shownId === pose.id) {
      return;
    }
    this.shownId = pose.id;
    this.showPose(pose);
    const { index, total } = this.session;
    part(this.root, "announcement").textContent = announcement(pose, grade, index, total);
    this.stopwatch.restart();
    prefetch(this.session, this.viewer);
  }

  private showPose(pose: Pose): void {
    const { image } = pose;
    this.overlay.setPoses(this.posesHere().map(drawn), pose.id);
    this.viewer.show(
      {
        previewUrl: image.preview_url,
        fullUrl: image.file_url,
        size: { width: image.width_px, height: image.height_px },
        description: `Photograph ${image.file_name}, looking at ${vesselName(pose)}`,
      },
      extent(pose),
    );
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

  private posesHere(): readonly Pose[] {
    const image = this.session.current?.image;
    return image === undefined ? [] : this.session.posesOfImage(image.id);
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
