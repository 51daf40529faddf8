/** The last ten decisions, newest first; each is a button that reopens what it was about. */
import { copyOf, element } from "../page/parts";
import { GRADE_NAMES, vesselName } from "./pose";
import type { Remembered, ReviewSession } from "./session";

export class DecisionStrip {
  constructor(
    private readonly list: HTMLElement,
    private readonly onReopen: (key: string) => void,
  ) {}

  show(session: ReviewSession): void {
    const items = session.strip.map((entry) => {
      const item = element("li");
      item.append(this.button(session, entry));
      return item;
    });
    this.list.replaceChildren(...items);
  }

  private button(session: ReviewSession, entry: Remembered): HTMLButtonElement {
    const { decision, key } = entry;
    const button = element("button", "decision");
    const isGrade = decision.kind === "grade";
    const reasons = isGrade ? decision.reasons : [];
    const verdict = isGrade ? GRADE_NAMES[decision.grade] : "Image complete";
    const why = reasons.length === 0 ? "" : ` (${reasons.join(", ").replaceAll("_", " ")})`;
    const name = nameOf(session, entry);
    button.type = "button";
    button.dataset["grade"] = isGrade ? decision.grade : "complete";
    button.title = `${name}: ${verdict}${why}. Reopen.`;
    button.setAttribute("aria-label", button.title);
    button.append(
      copyOf(this.list.ownerDocument, `mark-${button.dataset["grade"]}`),
      element("span", "decision__name", name),
    );
    if (reasons.length > 0) {
      button.append(element("span", "decision__reasons", String(reasons.length)));
    }
    button.classList.toggle("is-current", session.current?.key === key);
    button.addEventListener("click", () => {
      this.onReopen(key);
    });
    return button;
  }
}

function nameOf(session: ReviewSession, { decision }: Remembered): string {
  if (decision.kind === "complete") {
    return "Image";
  }
  if (decision.poseIds.length > 1) {
    return `${decision.poseIds.length} poses`;
  }
  const poseId = decision.poseIds[0] ?? 0;
  const pose = session.pose(poseId);
  return pose === null ? `Pose ${poseId}` : vesselName(pose);
}
