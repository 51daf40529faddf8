/**
 * A person's own keys: kept on the server, with a copy in this browser, so that they are there at
 * once and without a network. A change that could not be sent is sent when the page opens again.
 */
import { call } from "../api";
import type { Bindings, Keymap } from "./keymap";

const PREFIX = "quaymark.keys.";
const ADDRESS = "/api/v1/me/keys";

interface Copy {
  readonly bindings: Bindings;
  readonly unsent: boolean;
}

export class OwnKeys {
  private readonly name: string;

  constructor(
    user: string,
    private readonly keymap: Keymap,
  ) {
    this.name = PREFIX + user;
    keymap.set(this.read().bindings);
  }

  /** Brings the copy and the server together. */
  async sync(): Promise<void> {
    const copy = this.read();
    if (copy.unsent) {
      await this.send(copy.bindings);
      return;
    }
    const { bindings } = (await call(ADDRESS)) as { readonly bindings: Bindings };
    this.write({ bindings, unsent: false });
    this.keymap.set(bindings);
  }

  /** Holds at once; throws when the server does not have it yet. */
  async change(bindings: Bindings): Promise<void> {
    this.keymap.set(bindings);
    this.write({ bindings, unsent: true });
    await this.send(bindings);
  }

  private async send(bindings: Bindings): Promise<void> {
    await call(ADDRESS, { method: "PUT", json: { bindings } });
    this.write({ bindings, unsent: false });
  }

  private read(): Copy {
    try {
      const kept = JSON.parse(localStorage.getItem(this.name) ?? "null") as Copy | null;
      return kept ?? { bindings: {}, unsent: false };
    } catch {
      return { bindings: {}, unsent: false };
    }
  }

  private write(copy: Copy): void {
    try {
      localStorage.setItem(this.name, JSON.stringify(copy));
    } catch {
      // Without storage the keys come from the server each time.
    }
  }
}
