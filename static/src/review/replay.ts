/** Brings the session up to date with what waits to be sent, and with what the server answered. */
import { showFlash } from "../page/flashes";
import type { Grade } from "./pose";
import type { ReviewSession } from "./session";
import type { Decision } from "./verdicts";
import type { PendingWrite } from "./writes";

const SECOND_OPINION =
  "Someone else had graded that pose first. Your grade is kept as a second opinion.";

/** Does again, on the page only, what was done before it was opened and is still on its way. */
export function replay(writes: readonly PendingWrite[], session: ReviewSession): void {
  const { verdicts } = session;
  for (const { key, effect } of writes) {
    switch (effect.kind) {
      case "grade":
        takeAsMade({ ...effect, id: key, reasons: [] }, session);
        break;
      case "reasons":
        verdicts.amend(effect.decision, effect.reasons);
        break;
      case "complete":
        takeAsMade({ ...effect, id: key }, session);
        break;
      case "withdraw":
      case "reopen":
        session.withdraw(effect.decision);
        break;
      case "bookmark":
      case "other":
        break; // nothing that the way depends on
    }
  }
}

function takeAsMade(decision: Decision, session: ReviewSession): void {
  session.verdicts.decide(decision);
  session.count(decision);
}

interface Answer {
  readonly second_opinion?: boolean;
  readonly poses?: readonly {
    readonly pose_id: number;
    readonly mine: { readonly grade: Grade } | null;
    readonly review: { readonly grade: Grade } | null;
  }[];
}

/** Takes an answer in; true when what is shown may have changed. */
export function settle(
  { effect }: PendingWrite,
  answer: unknown,
  session: ReviewSession,
): boolean {
  const { second_opinion: isSecond, poses } = (answer ?? {}) as Answer;
  if (effect.kind === "grade" && isSecond === true && !session.expectsOpinions) {
    showFlash(SECOND_OPINION, "info");
  }
  if (effect.kind !== "withdraw" || poses === undefined) {
    return false;
  }
  for (const { pose_id: poseId, mine, review } of poses) {
    session.verdicts.tell(poseId, mine ?? review);
  }
  return true;
}
