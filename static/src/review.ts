/** The review island: loads a run's poses, lets a person grade them, and keeps every grade safe. */
import { ApiProblem, call, explain } from "./api";
import { showFlash } from "./page/flashes";
import { part } from "./page/parts";
import type { Action } from "./review/keymap";
import { Outbox, type PendingReview } from "./review/outbox";
import { GRADES, vesselName } from "./review/pose";
import { loadPoses } from "./review/pose-loader";
import { ReviewKeys } from "./review/review-keys";
import { ReviewScreen } from "./review/review-screen";
import { ReviewSession } from "./review/session";
import { SyncStatus } from "./review/sync-status";
import { ViewKeys } from "./viewer/gestures/view-keys";

const root = document.querySelector<HTMLElement>("[data-review]");
if (root !== null) {
  open(root, Number(root.dataset["run"]), root.dataset["user"] ?? "");
}

function open(root: HTMLElement, runId: number, user: string): void {
  const session = new ReviewSession();
  const outbox = openOutbox(root, session, user, runId, () => {
    screen.show();
  });
  const screen = new ReviewScreen(root, runId, session, (pose, grade, seconds) => {
    outbox.add(pose.id, grade, seconds);
  });
  const act = (action: Action): void => {
    screen.act(action);
  };
  new ReviewKeys(new ViewKeys(screen.viewer), act, (peeking) => {
    screen.setPeek(peeking);
  });
  listenToButtons(root, act);
  for (const moment of ["online", "focus"]) {
    window.addEventListener(moment, () => {
      outbox.flush();
    });
  }
  outbox.flush();
  load(root, session, outbox, screen, runId).catch((error: unknown) => {
    showLoadError(root, error);
  });
}

function openOutbox(
  root: HTMLElement,
  session: ReviewSession,
  user: string,
  runId: number,
  onWithdrawn: () => void,
): Outbox {
  const status = new SyncStatus(part(root, "sync"));
  const send = async (review: PendingReview): Promise<void> => {
    await call(`/api/v1/poses/${review.poseId}/reviews`, {
      method: "POST",
      json: { grade: review.grade, reasons: [], comment: null, seconds: review.seconds },
      idempotencyKey: review.key,
      keepalive: true,
    });
    session.acknowledge(review.poseId, review.grade);
  };
  const outbox = new Outbox(localStorage, user, runId, send, {
    onChange: (state, waiting) => {
      status.show(state, waiting);
    },
    onRefused: (review, problem) => {
      const pose = session.pose(review.poseId);
      const name = pose === null ? `pose ${review.poseId}` : vesselName(pose);
      showFlash(`The grade of ${name} was not stored. ${explain(problem)}`, "error");
      if (!outbox.pending.some(({ poseId }) => poseId === review.poseId)) {
        session.withdraw(review.poseId);
        onWithdrawn();
      }
    },
  });
  return outbox;
}

/** Work begins with the first ungraded pose, or the one named in the address, as soon as it is here. */
async function load(
  root: HTMLElement,
  session: ReviewSession,
  outbox: Outbox,
  screen: ReviewScreen,
  runId: number,
): Promise<void> {
  const wanted = Number(new URL(location.href).searchParams.get("pose") ?? "0");
  let started = false;
  for await (const poses of loadPoses(runId)) {
    session.append(poses);
    for (const { poseId, grade } of outbox.pending) {
      if (session.pose(poseId) !== null && session.gradeOf(poseId) !== grade) {
        session.restore(poseId, grade);
      }
    }
    if (!started) {
      started = wanted > 0 ? session.goTo(wanted) !== null : session.toFirstUngraded();
    }
    if (started) {
      screen.show();
    }
  }
  if (!started) {
    session.toFirstUngraded(); // the pose named in the address is not of this run
    screen.show();
  }
  root.dataset["state"] = session.total === 0 ? "empty" : "loaded";
}

function listenToButtons(root: HTMLElement, act: (action: Action) => void): void {
  root.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("button") : null;
    const action = button === null ? null : actionOfButton(button);
    if (button === null || action === null) {
      return;
    }
    act(action);
    if (event.detail > 0 && action.kind !== "layers" && action.kind !== "help") {
      part(root, "viewer").focus({ preventScroll: true }); // so that Space peeks again
    }
  });
}

function actionOfButton(button: HTMLButtonElement): Action | null {
  const grade = GRADES.find((name) => name === button.dataset["grade"]);
  if (button.hasAttribute("data-grade-button") && grade !== undefined) {
    return { kind: "grade", grade };
  }
  switch (button.dataset["act"]) {
    case "next-box":
      return { kind: "box", by: 1 };
    case "previous-box":
      return { kind: "box", by: -1 };
    case "framing":
      return { kind: "framing" };
    case "layers":
      return { kind: "layers" };
    case "help":
      return { kind: "help" };
    case "back":
      return { kind: "back" };
    default:
      return null;
  }
}

function showLoadError(root: HTMLElement, error: unknown): void {
  root.dataset["state"] = "failed";
  const signIn = error instanceof ApiProblem && error.status === 401 ? " Sign in again." : "";
  showFlash(`The poses could not be loaded. ${explain(error)}${signIn}`, "error");
}
