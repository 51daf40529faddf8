/** Says in one line whether everything has reached the server. */
import type { OutboxState } from "./outbox";

export function syncText(state: OutboxState, waiting: number): string {
  const kept = waiting === 1 ? "1 change kept here" : `${waiting} changes kept here`;
  switch (state) {
    case "idle":
      return "All saved";
    case "sending":
      return waiting > 3 ? `Saving ${waiting} changes` : "Saving";
    case "offline":
      return `No connection, ${kept}`;
    case "signed-out":
      return `Signed out, ${kept}`;
    case "somebody-else":
      return `Signed in as somebody else, ${kept}`;
  }
}

export class SyncStatus {
  private readonly text: Element | null;
  private readonly signIn: HTMLElement | null;

  constructor(private readonly element: HTMLElement) {
    this.text = element.querySelector("[data-sync-text]");
    this.signIn = element.querySelector<HTMLElement>("[data-sync-sign-in]");
  }

  show(state: OutboxState, waiting: number): void {
    this.element.dataset["state"] = state;
    const text = syncText(state, waiting);
    if (this.text !== null && this.text.textContent !== text) {
      this.text.textContent = text;
    }
    if (this.signIn !== null) {
      this.signIn.hidden = !["signed-out", "somebody-else"].includes(state);
    }
  }
}
