/**
 * What a reviewer does, as the server is told of it: one write an act, whole in itself.
 *
 * A write needs nothing that only an earlier answer could tell, so that it may wait, be sent late
 * and be sent twice. `effect` says what it means here; a page that opens while writes still wait
 * replays their effects, and so shows what the reviewer did and not what the server knows by then.
 */
import type { CallOptions } from "../api";
import type { Grade } from "./pose";

export type Effect =
  | {
      /** The decision's name is the write's key. */
      readonly kind: "grade";
      readonly imageId: number;
      readonly poseIds: readonly number[];
      readonly grade: Grade;
    }
  | { readonly kind: "reasons"; readonly decision: string; readonly reasons: readonly string[] }
  | { readonly kind: "withdraw"; readonly decision: string }
  | { readonly kind: "complete"; readonly imageId: number }
  | { readonly kind: "reopen"; readonly decision: string }
  | { readonly kind: "bookmark"; readonly key: string; readonly on: boolean }
  | { readonly kind: "other" };

export interface Write {
  /** What it is about, "image:3": writes of one channel go in the order given. */
  readonly channel: string;
  readonly method: NonNullable<CallOptions["method"]>;
  readonly url: string;
  readonly json?: unknown;
  /** In words, for the message should it be refused: "The grade of ANNEGRET". */
  readonly label: string;
  readonly runId: number;
  readonly effect: Effect;
}

export interface PendingWrite extends Write {
  /** The idempotency key: however often it is sent, it happens once. */
  readonly key: string;
  readonly user: string;
  /** Milliseconds since the epoch, made unique by fractions: the order of sending. */
  readonly order: number;
}
