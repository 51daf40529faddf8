/** The list of missed vessels beside the photograph, and the reasons to choose from. */
import { element, part } from "../../page/parts";
import type { MissedReason, MissedVessel } from "../surroundings";
import { MISSED_WORDS } from "../words";

export class MissedPanel {
  private readonly panel: HTMLElement;

  constructor(
    root: HTMLElement,
    private readonly onChoose: (id: number) => void,
  ) {
    this.panel = part(root, "missed-panel");
  }

  open(): void {
    this.panel.hidden = false;
  }

  close(): void {
    this.panel.hidden = true;
  }

  show(
    missed: readonly MissedVessel[],
    chosenId: number | null,
    isNew: boolean,
    reason: MissedReason | null,
  ): void {
    part(this.panel, "missed-what").textContent = whatToDo(isNew, chosenId !== null);
    part(this.panel, "missed-delete").hidden = !isNew && chosenId === null;
    for (const button of this.panel.querySelectorAll<HTMLElement>(".missed-reason")) {
      const isReason = reason !== null && button.dataset["command"] === `missed.${reason}`;
      button.setAttribute("aria-pressed", String(isReason));
      button.toggleAttribute("disabled", !isNew && chosenId === null);
    }
    part(this.panel, "missed-list").replaceChildren(
      ...missed.map((vessel, index) => this.row(vessel, index, vessel.id === chosenId)),
    );
  }

  private row(vessel: MissedVessel, index: number, isChosen: boolean): HTMLElement {
    const button = element("button", "missed-row");
    button.type = "button";
    button.setAttribute("aria-pressed", String(isChosen));
    const words = MISSED_WORDS[vessel.reason];
    button.append(
      element("span", "missed-row__number number", String(index + 1)),
      element("span", "", words),
      element("span", "muted small", vessel.user ?? ""),
    );
    button.setAttribute("aria-label", `Missed vessel ${index + 1}: ${words}`);
    button.addEventListener("click", () => {
      this.onChoose(vessel.id);
    });
    const item = element("li");
    item.append(button);
    return item;
  }
}

function whatToDo(isNew: boolean, isChosen: boolean): string {
  if (isNew) {
    return "Why has this vessel no box? One key stores it.";
  }
  return isChosen
    ? "Drag it or its corners, choose another reason, or delete it."
    : "Drag a box around a visible vessel that has none.";
}
