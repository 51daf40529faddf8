/**
 * Changes not saved yet, kept in the browser: a closed tab or a lost session loses none of them.
 * The idempotency key is kept with them, so that saving again after an answer that never came
 * stores one correction and not two.
 */
import { randomKey } from "../../random-key";
import type { LocalBox } from "./box";

export interface Draft {
  readonly box: LocalBox;
  /** The version that the changes were made on. */
  readonly version: number;
  readonly key: string;
}

type Store = Pick<Storage, "getItem" | "setItem" | "removeItem">;

const PREFIX = "quaymark.edit.";

export class Drafts {
  constructor(
    private readonly store: Store,
    private readonly user: string,
  ) {}

  read(poseId: number): Draft | null {
    try {
      const found: unknown = JSON.parse(this.store.getItem(this.name(poseId)) ?? "null");
      return isDraft(found) ? found : null;
    } catch {
      return null;
    }
  }

  write(poseId: number, box: LocalBox, version: number): Draft {
    const draft = { box, version, key: randomKey() };
    try {
      this.store.setItem(this.name(poseId), JSON.stringify(draft));
    } catch {
      // Without storage the changes last until the page is left.
    }
    return draft;
  }

  forget(poseId: number): void {
    this.store.removeItem(this.name(poseId));
  }

  private name(poseId: number): string {
    return `${PREFIX}${this.user}.${poseId}`;
  }
}

function isDraft(value: unknown): value is Draft {
  return (
    typeof value === "object" &&
    value !== null &&
    "box" in value &&
    "version" in value &&
    "key" in value &&
    typeof value.key === "string"
  );
}
