/**
 * Unsaved work that survives a reload or a lost session: kept in this browser, per person and
 * viewport, together with the saved state it began from, so that it can be merged later.
 */
import type { Points } from "./point";

export interface Draft {
  readonly version: number;
  readonly base: Points;
  readonly points: Points;
  readonly savedAt: string;
}

export interface Store {
  getItem(key: string): string | null;
  setItem(key: string, value: string): void;
  removeItem(key: string): void;
}

export class DraftBox {
  private readonly key: string;

  constructor(
    private readonly store: Store,
    user: string,
    viewportId: number,
  ) {
    this.key = `quaymark.register.${user}.${viewportId}`;
  }

  read(): Draft | null {
    try {
      const draft = JSON.parse(this.store.getItem(this.key) ?? "null") as Draft | null;
      return draft !== null && Array.isArray(draft.points) && Array.isArray(draft.base) ? draft : null;
    } catch {
      return null; // forbidden storage or a draft of another age: there is nothing to restore
    }
  }

  /** Whether the browser kept it. */
  write(draft: Draft): boolean {
    try {
      this.store.setItem(this.key, JSON.stringify(draft));
      return true;
    } catch {
      return false;
    }
  }

  clear(): void {
    try {
      this.store.removeItem(this.key);
    } catch {
      // Without storage there is no draft either.
    }
  }
}
