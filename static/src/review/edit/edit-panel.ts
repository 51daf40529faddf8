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
    this.set("across", signed(change.across_m, "m"), change.across_m);
    this.set("away", signed(change.away_m, "m"), change.away_m);
    this.set("heading_deg", heading(draft.heading_deg), change.heading_deg, "°");
    for (const key of ["length_m", "width_m", "height_m"] as const) {
      this.set(key, quantity(draft[key], "m", 1), change[key], "m");
    }
  }

  /** `unit` is given where the value itself is not the change. */
  private set(name: string, value: string, change: number, unit = ""): void {
    const row = part(this.panel, `edit-${name}`);
    row.classList.toggle("is-changed", Math.abs(change) >= UNCHANGED);
    part(row, "value").textContent = value;
    const beside = row.querySelector('[data-part="change"]');
    if (beside !== null) {
      beside.textContent = Math.abs(change) < UNCHANGED ? "as generated" : signed(change, unit);
    }
  }
}

/** A change with its sign, always: +1.2 m. */
function signed(value: number, unit: string): string {
  const text = Math.abs(value) < UNCHANGED ? "0.0" : number(value, 1);
  const sign = value >= UNCHANGED ? "+" : "";
  return unit === "°" ? `${sign}${text}°` : `${sign}${text}\u00a0${unit}`;
}
