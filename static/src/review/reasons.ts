/**
 * Reasons for the decision just made, while the next pose already shows: a row of chips, one key
 * each. Whoever has no reason to give does nothing: any other key goes on with the work.
 */
import { part } from "../page/parts";
import { REASON_COMMANDS } from "./commands";
import { keyNames, type Keymap } from "./keymap";
import type { Mode, ModeMachine } from "./modes";
import { GRADE_NAMES, type Grade } from "./pose";
import type { GradeDecision } from "./verdicts";

export class ReasonsMode implements Mode {
  readonly name = "reasons";
  readonly title = "";
  readonly hint = "";
  readonly commands = REASON_COMMANDS;
  readonly fallsThrough = true;
  private readonly panel: HTMLElement;
  private decision: GradeDecision | null = null;

  constructor(
    root: HTMLElement,
    private readonly machine: ModeMachine,
    private readonly keymap: Keymap,
    private readonly onReasons: (decision: GradeDecision, reasons: readonly string[]) => void,
  ) {
    this.panel = part(root, "reasons");
    this.panel.addEventListener("click", (event) => {
      const chip = event.target instanceof Element ? event.target.closest("button") : null;
      const reason = chip?.dataset["reason"];
      if (reason !== undefined) {
        this.toggle(reason);
      }
    });
    keymap.onChange(() => {
      this.showKeys();
    });
    this.showKeys();
  }

  /** Offers the reasons of a decision about a pose with this name; Good has none. */
  offer(decision: GradeDecision, name: string): void {
    if (this.chips(decision.grade).length === 0) {
      this.close();
      return;
    }
    this.decision = decision;
    part(this.panel, "reasons-for").textContent = `${name}: ${GRADE_NAMES[decision.grade]}. Why?`;
    for (const row of this.panel.querySelectorAll<HTMLElement>("[data-reasons-of]")) {
      row.hidden = row.dataset["reasonsOf"] !== decision.grade;
    }
    this.showPressed();
    this.panel.hidden = false;
    this.machine.enter("reasons");
  }

  /** The decision is gone or another matter has begun. */
  close(): void {
    this.decision = null;
    this.panel.hidden = true;
    if (this.machine.current === this) {
      this.machine.leave();
    }
  }

  enter(): boolean {
    return this.decision !== null;
  }

  leave(): void {
    // The chips stay for the pointer until the next decision; only their keys go.
    this.panel.classList.remove("has-keys");
  }

  act(commandId: string): void {
    const index = REASON_COMMANDS.findIndex(({ id }) => id === commandId);
    const chip = this.decision === null ? undefined : this.chips(this.decision.grade)[index];
    if (chip?.dataset["reason"] !== undefined) {
      this.toggle(chip.dataset["reason"]);
    }
  }

  private toggle(reason: string): void {
    const { decision } = this;
    if (decision === null) {
      return;
    }
    const reasons = decision.reasons.includes(reason)
      ? decision.reasons.filter((one) => one !== reason)
      : [...decision.reasons, reason];
    this.decision = { ...decision, reasons };
    this.showPressed();
    this.onReasons(decision, reasons);
  }

  private showPressed(): void {
    const { decision } = this;
    if (decision === null) {
      return;
    }
    this.panel.classList.add("has-keys");
    for (const chip of this.chips(decision.grade)) {
      const pressed = decision.reasons.includes(chip.dataset["reason"] ?? "");
      chip.setAttribute("aria-pressed", String(pressed));
    }
  }

  private showKeys(): void {
    for (const row of this.panel.querySelectorAll("[data-reasons-of]")) {
      row.querySelectorAll(".kbd").forEach((key, i) => {
        const command = REASON_COMMANDS[i];
        key.textContent = command === undefined ? "" : keyNames(this.keymap, command).join(" ");
      });
    }
  }

  private chips(grade: Grade): readonly HTMLButtonElement[] {
    return [
      ...this.panel.querySelectorAll<HTMLButtonElement>(`[data-reasons-of="${grade}"] button`),
    ];
  }
}
