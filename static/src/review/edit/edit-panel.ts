/** The figures of the box that is edited: each value, and its change against the generated one. */
import { heading, number, quantity } from "../../format";
import { part } from "../../page/parts";
import { changeBetween, type Bearings, type LocalBox } from "./box";

const UNCHANGED = 0.05;

export class EditPanel {
  private readonly panel: HTMLElement;

  constructor(private readonly root: HTMLElement) {
    this.panel = part(root, "edit-panel");
  }

  open(vessel: string, canReset: boolean): void {
    this.panel.hidden = false;
    part(this.root, "edit-vessel").textContent = vessel;
    part(this.root, "edit-reset").hidden = !canReset;
    this.setBusy(false);
  }

  close(): void {
    this.panel.hidden = true;
  }

  setBusy(busy: boolean): void {
    for (const button of this.panel.querySelectorAll("button")) {
      button.disabled = busy;
    }
  }

  show(generated: LocalBox, draft: LocalBox, bearings: Bearings): void {
    const change = changeBetween(generated, draft, bearings);
    const { across_m: across, away_m: away } = change;
    this.set("across", shift(across), across, across < 0 ? "to the left" : "to the right");
    this.set("away", shift(away), away, away < 0 ? "nearer" : "farther");
    const turn = `${signed(change.heading_deg)}°`;
    this.set("heading_deg", heading(draft.heading_deg), change.heading_deg, turn);
    for (const key of ["length_m", "width_m", "height_m"] as const) {
      const grown = `${signed(change[key])}\u00a0m`;
      this.set(key, quantity(draft[key], "m", 1), change[key], grown);
    }
  }

  /** `words` say the change; a value that is as generated says so instead. */
  private set(name: string, value: string, change: number, words: string): void {
    const row = part(this.panel, `edit-${name}`);
    const isChanged = Math.abs(change) >= UNCHANGED;
    row.classList.toggle("is-changed", isChanged);
    part(row, "value").textContent = value;
    part(row, "change").textContent = isChanged ? words : "as generated";
  }
}

/** A distance without its sign, which the words beside it tell. */
function shift(metres: number): string {
  return quantity(Math.abs(metres), "m", 1);
}

/** A change with its sign, always: +1.2. */
function signed(value: number): string {
  return `${value > 0 ? "+" : ""}${number(value, 1)}`;
}
