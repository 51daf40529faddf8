/** The last ten decisions, newest first; each is a button that reopens its pose. */
import { copyOf, element } from "../page/parts";
import { GRADE_NAMES, vesselName } from "./pose";
import type { ReviewSession } from "./session";

export class DecisionStrip {
  constructor(
    private readonly list: HTMLElement,
    private readonly onReopen: (poseId: number) => void,
  ) {}

  show(session: ReviewSession): void {
    const items = session.strip.map(({ poseId, grade }) => {
      const pose = session.pose(poseId);
      const name = pose === null ? `Pose ${poseId}` : vesselName(pose);
      const button = element("button", "decision");
      button.type = "button";
      button.dataset["grade"] = grade;
      button.title = `${name}: ${GRADE_NAMES[grade]}. Reopen.`;
      button.setAttribute("aria-label", button.title);
      button.append(
        copyOf(this.list.ownerDocument, `mark-${grade}`),
        element("span", "decision__name", name),
      );
      button.classList.toggle("is-current", session.current?.id === poseId);
      button.addEventListener("click", () => {
        this.onReopen(poseId);
      });
      const item = element("li");
      item.append(button);
      return item;
    });
    this.list.replaceChildren(...items);
  }
}
