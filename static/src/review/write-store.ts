/**
 * Writes kept in the browser's storage, one entry each, shared by all tabs of this origin.
 *
 * The storage is the truth, not a tab's memory: what another tab added is sent too, and what
 * another tab has sent is gone. Without a storage (full, forbidden) writes live as long as the page.
 */
import { randomKey } from "../random-key";
import type { PendingWrite, Write } from "./writes";

export type Store = Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">;

const PREFIX = "quaymark.write.";

export class WriteStore {
  /** Those that the storage did not take. */
  private readonly unstored = new Map<string, PendingWrite>();
  private lastOrder = 0;

  constructor(
    private readonly store: Store,
    private readonly user: string,
  ) {}

  add(write: Write): PendingWrite {
    this.lastOrder = Math.max(Date.now(), this.lastOrder + 0.001);
    const pending = { ...write, key: randomKey(), user: this.user, order: this.lastOrder };
    try {
      this.store.setItem(PREFIX + pending.key, JSON.stringify(pending));
    } catch {
      this.unstored.set(pending.key, pending);
    }
    return pending;
  }

  remove({ key }: PendingWrite): void {
    this.unstored.delete(key);
    this.store.removeItem(PREFIX + key);
  }

  has({ key }: PendingWrite): boolean {
    return this.unstored.has(key) || this.store.getItem(PREFIX + key) !== null;
  }

  /** This person's writes of all tabs, oldest first; other people's wait until they come back. */
  all(): readonly PendingWrite[] {
    const found = [...this.unstored.values()];
    for (let i = 0; i < this.store.length; i += 1) {
      const write = this.read(this.store.key(i));
      if (write?.user === this.user) {
        found.push(write);
      }
    }
    return found.sort((a, b) => a.order - b.order);
  }

  private read(name: string | null): PendingWrite | null {
    if (name?.startsWith(PREFIX) !== true) {
      return null;
    }
    try {
      return JSON.parse(this.store.getItem(name) ?? "null") as PendingWrite | null;
    } catch {
      return null; // not ours, or cut short: nothing that could be sent
    }
  }
}

/** Whether a change of the storage, made by another tab, concerns waiting writes. */
export function concernsWrites(event: StorageEvent): boolean {
  return event.key === null || event.key.startsWith(PREFIX);
}
