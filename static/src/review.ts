/** The review island: brings poses and images, lets a person judge them, and keeps every act safe. */
import { ApiProblem, call, explain } from "./api";
import { showFlash } from "./page/flashes";
import { part } from "./page/parts";
import { REVIEW_COMMANDS } from "./review/commands";
import type { Feed } from "./review/feed";
import { Help } from "./review/help";
import { Keymap, keyNames } from "./review/keymap";
import { LiveFigures } from "./review/live-figures";
import { Outbox } from "./review/outbox";
import { OwnKeys } from "./review/own-keys";
import { OwnSession } from "./review/own-session";
import { QueueFeed, queueById, queueOfRun } from "./review/queue-feed";
import { Recorder } from "./review/recorder";
import { RememberedDecisions } from "./review/remembered";
import { replay, settle } from "./review/replay";
import { ReviewKeys } from "./review/review-keys";
import { ReviewScreen } from "./review/review-screen";
import { RunFeed } from "./review/run-feed";
import { keyOf, ReviewSession } from "./review/session";
import { SyncStatus } from "./review/sync-status";
import { concernsWrites, WriteStore } from "./review/write-store";
import type { PendingWrite } from "./review/writes";
import { ViewKeys } from "./viewer/gestures/view-keys";

const root = document.querySelector<HTMLElement>("[data-review]");
if (root !== null) {
  open(root).catch((error: unknown) => {
    showLoadError(root, error);
  });
}

async function open(root: HTMLElement): Promise<void> {
  const runId = Number(root.dataset["run"]);
  const user = root.dataset["user"] ?? "";
  const keymap = new Keymap();
  const ownKeys = new OwnKeys(user, keymap);
  const session = new ReviewSession();
  const remembered = new RememberedDecisions(user, runId);
  session.verdicts.recall(remembered.read());
  const outbox = openOutbox(root, session, user, {
    changed: () => {
      screen.show();
    },
    settled: () => {
      feed.settled();
      figures.changed();
    },
  });
  replay(outbox.pending.filter((write) => write.runId === runId), session);
  const feed = await feedOf(root, runId, session, () => {
    screen.more();
  });
  const figures = new LiveFigures(root, `run_id=${runId}`);
  const screen = new ReviewScreen(root, {
    runId,
    figures,
    session,
    feed,
    recorder: new Recorder(outbox, runId),
    keymap,
    remembered,
    openHelp: () => {
      help.open();
    },
  });
  const help = new Help(document, screen.machine, keymap, (bindings) => {
    ownKeys.change(bindings).catch((error: unknown) => {
      showFlash(`The keys are kept in this browser only, for now. ${explain(error)}`, "warning");
    });
  });
  listen(root, screen, keymap, help);
  keepSending(outbox);
  await start(root, feed, session, screen);
  ownKeys.sync().catch(() => undefined); // the copy in this browser does until then
}

/** What is to be reviewed: a queue, a pose named in the address, or else what nobody has graded. */
async function feedOf(
  root: HTMLElement,
  runId: number,
  session: ReviewSession,
  onMore: () => void,
): Promise<Feed> {
  if (wantedPose() !== null) {
    return new RunFeed(runId, session, onMore);
  }
  const asked = Number(root.dataset["queue"] ?? "0");
  const queue = asked > 0 ? await queueById(asked) : await queueOfRun(runId);
  if (asked === 0 && queue.progress.done >= queue.progress.total) {
    return new RunFeed(runId, session, onMore); // all is graded: to be looked through
  }
  return new QueueFeed(queue, session, onMore, (error) => {
    showFlash(`The next poses could not be fetched. ${explain(error)}`, "warning");
  });
}

function wantedPose(): number | null {
  const wanted = Number(new URL(location.href).searchParams.get("pose") ?? "0");
  return wanted > 0 ? wanted : null;
}

/** Work begins with the first stop that is due, or the pose named in the address. */
async function start(
  root: HTMLElement,
  feed: Feed,
  session: ReviewSession,
  screen: ReviewScreen,
): Promise<void> {
  await feed.start();
  part(root, "title").textContent = feed.title;
  const wanted = wantedPose();
  if (wanted === null || !session.goTo(keyOf(wanted))) {
    session.toFirstDue();
  }
  if (wanted !== null && session.current?.pose?.id !== wanted) {
    screen.open(keyOf(wanted));
  }
  screen.show();
  root.dataset["state"] = session.stopCount === 0 && feed.state === "drained" ? "empty" : "loaded";
}

function openOutbox(
  root: HTMLElement,
  session: ReviewSession,
  user: string,
  on: { readonly changed: () => void; readonly settled: () => void },
): Outbox {
  const status = new SyncStatus(part(root, "sync"));
  const own = new OwnSession(user);
  const send = async (write: PendingWrite): Promise<unknown> =>
    own.run(async () =>
      call(write.url, {
        method: write.method,
        ...(write.json === undefined ? {} : { json: write.json }),
        idempotencyKey: write.key,
        keepalive: true,
      }),
    );
  return new Outbox(new WriteStore(localStorage, user), send, {
    onChange: (state, waiting) => {
      status.show(state, waiting);
      if (state === "idle") {
        on.settled();
      }
    },
    onSent: (write, answer) => {
      if (settle(write, answer, session)) {
        on.changed();
      }
    },
    onRefused: (write, problem) => {
      showFlash(`${write.label} was not stored. ${explain(problem)}`, "error");
      session.withdraw(write.key);
      on.changed();
    },
  });
}

function keepSending(outbox: Outbox): void {
  for (const moment of ["online", "focus", "pageshow"]) {
    window.addEventListener(moment, () => {
      outbox.flush();
    });
  }
  window.addEventListener("storage", (event) => {
    if (concernsWrites(event)) {
      outbox.reread();
    }
  });
  outbox.flush();
}

function listen(root: HTMLElement, screen: ReviewScreen, keymap: Keymap, help: Help): void {
  new ReviewKeys(
    screen.machine,
    keymap,
    new ViewKeys(screen.viewer),
    (peeking) => {
      screen.setPeek(peeking);
    },
    () => {
      help.open();
    },
  );
  root.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("button") : null;
    const command = button?.dataset["act"];
    if (command === undefined) {
      return;
    }
    if (screen.machine.current.name === "reasons") {
      screen.machine.leave();
    }
    screen.act(command);
    const keepsFocus = ["review.layers", "review.help", "review.comment", "review.guideline"].includes(command);
    if (event.detail > 0 && !keepsFocus) {
      part(root, "viewer").focus({ preventScroll: true }); // so that Space peeks again
    }
  });
  const showKeys = (): void => {
    showKeysOnButtons(root, keymap);
  };
  keymap.onChange(showKeys);
  showKeys();
}

/** The keys beside the buttons are the person's own. */
function showKeysOnButtons(root: HTMLElement, keymap: Keymap): void {
  for (const command of REVIEW_COMMANDS) {
    const names = keyNames(keymap, command).join(" ");
    const keys = `[data-act="${command.id}"] .kbd, [data-key-of="${command.id}"]`;
    for (const key of root.querySelectorAll(keys)) {
      key.textContent = names;
    }
    for (const button of root.querySelectorAll<HTMLElement>(`[data-act="${command.id}"]`)) {
      if (button.dataset["title"] !== undefined) {
        button.title = `${button.dataset["title"]} (${names})`;
      }
    }
  }
}

function showLoadError(root: HTMLElement, error: unknown): void {
  root.dataset["state"] = "failed";
  const signIn = error instanceof ApiProblem && error.status === 401 ? " Sign in again." : "";
  showFlash(`The poses could not be loaded. ${explain(error)}${signIn}`, "error");
}
