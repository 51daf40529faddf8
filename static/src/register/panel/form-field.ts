/** A labelled field of the template with its error line: what a typed value needs to be answered. */
import { part } from "../../page/parts";

export class FormField {
  readonly input: HTMLInputElement;
  private readonly error: HTMLElement;

  constructor(root: ParentNode, name: string, onChange: () => void) {
    const input = part(root, name);
    if (!(input instanceof HTMLInputElement)) {
      throw new Error(`data-part="${name}" is no input.`);
    }
    this.input = input;
    this.error = part(root, `${name}-error`);
    input.addEventListener("change", onChange);
    input.addEventListener("keydown", (event) => {
      if (event.key === "Enter") {
        event.preventDefault();
        onChange();
      }
    });
  }

  get value(): string {
    return this.input.value;
  }

  /** Fills in what is known, unless a person is typing here or has a mistake to correct. */
  fill(text: string, isForced: boolean): void {
    const isBusy = document.activeElement === this.input || this.isWrong;
    if (isForced || !isBusy) {
      this.input.value = text;
      this.say(null);
    }
  }

  get isWrong(): boolean {
    return this.input.getAttribute("aria-invalid") === "true";
  }

  say(error: string | null): void {
    this.error.textContent = error ?? "";
    this.error.hidden = error === null;
    if (error === null) {
      this.input.removeAttribute("aria-invalid");
    } else {
      this.input.setAttribute("aria-invalid", "true");
    }
  }
}
