/**
 * Grades on their way to the server. Each is written to the browser's storage in the same instant
 * as the key is pressed and leaves it only once the server has acknowledged it, so that neither a
 * closed tab nor a dead network loses one; its idempotency key keeps it single however often it is
 * sent. They go one at a time in the order given, so that a second thought never arrives first.
 */
import { ApiProblem } from "../api";
import { randomKey } from "../random-key";
import type { Grade } from "./pose";

export interface PendingReview {
  readonly key: string;
  readonly user: string;
  readonly runId: number;
  readonly poseId: number;
  readonly grade: Grade;
  readonly seconds: number;
  /** Milliseconds since the epoch plus a counter: the order of sending. */
  readonly order: number;
}

export type OutboxState = "idle" | "sending" | "offline" | "signed-out";

export interface OutboxEvents {
  readonly onChange: (state: OutboxState, waiting: number) => void;
  /** The server will never take this one; it is no longer waiting. */
  readonly onRefused: (review: PendingReview, problem: ApiProblem) => void;
}

type Store = Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">;

const PREFIX = "quaymark.review.";
const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 15_000;

export class Outbox {
  private readonly waiting: PendingReview[];
  private running = false;
  /** The last attempt got no answer that settles it: what is shown stays until one does. */
  private failing = false;
  private delayMs = FIRST_DELAY_MS;
  private wake: (() => void) | null = null;
  private lastOrder = 0;

  constructor(
    private readonly store: Store,
    private readonly user: string,
    private readonly runId: number,
    private readonly send: (review: PendingReview) => Promise<void>,
    private readonly events: OutboxEvents,
  ) {
    this.waiting = this.readAll();
  }

  /** Grades of this run that the server has not acknowledged yet, oldest first. */
  get pending(): readonly PendingReview[] {
    return this.waiting.filter((review) => review.runId === this.runId);
  }

  /** Keeps a grade and sends it when its turn comes. */
  add(poseId: number, grade: Grade, seconds: number): void {
    this.lastOrder = Math.max(Date.now(), this.lastOrder + 0.001);
    const review: PendingReview = {
      key: randomKey(),
      user: this.user,
      runId: this.runId,
      poseId,
      grade,
      seconds,
      order: this.lastOrder,
    };
    try {
      this.store.setItem(PREFIX + review.key, JSON.stringify(review));
    } catch {
      // A full or forbidden storage: the grade still goes out, it only does not outlive the page.
    }
    this.waiting.push(review);
    this.flush();
  }

  /** Starts sending, or tries again at once if it was waiting for better times. */
  flush(): void {
    if (this.running) {
      this.wake?.();
    } else {
      void this.run();
    }
  }

  private async run(): Promise<void> {
    this.running = true;
    let review = this.waiting[0];
    while (review !== undefined) {
      await this.deliver(review);
      review = this.waiting[0];
    }
    this.running = false;
    this.events.onChange("idle", 0);
  }

  private async deliver(review: PendingReview): Promise<void> {
    if (!this.failing) {
      this.events.onChange("sending", this.waiting.length);
    }
    try {
      await this.send(review);
      this.settle(review);
    } catch (error) {
      if (isFinal(error)) {
        this.settle(review);
        this.events.onRefused(review, error);
        return;
      }
      this.failing = true;
      const signedOut = error instanceof ApiProblem && error.status === 401;
      this.events.onChange(signedOut ? "signed-out" : "offline", this.waiting.length);
      await this.pause();
    }
  }

  private settle(review: PendingReview): void {
    this.waiting.splice(this.waiting.indexOf(review), 1);
    this.store.removeItem(PREFIX + review.key);
    this.delayMs = FIRST_DELAY_MS;
    this.failing = false;
  }

  private async pause(): Promise<void> {
    await new Promise<void>((resolve) => {
      const timer = setTimeout(resolve, this.delayMs);
      this.wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
    this.wake = null;
    this.delayMs = Math.min(LONGEST_DELAY_MS, this.delayMs * 2);
  }

  private readAll(): PendingReview[] {
    const found: PendingReview[] = [];
    for (let i = 0; i < this.store.length; i += 1) {
      const name = this.store.key(i);
      const text = name?.startsWith(PREFIX) === true ? this.store.getItem(name) : null;
      if (text !== null) {
        found.push(JSON.parse(text) as PendingReview);
      }
    }
    // Another person's grades, left behind on this machine, go out when they come back.
    return found
      .filter((review) => review.user === this.user)
      .sort((a, b) => a.order - b.order);
  }
}

/** Whether sending the same again can never succeed. */
function isFinal(error: unknown): error is ApiProblem {
  // Anything else than the server's own words (no network, a captive portal's page) may pass.
  return (
    error instanceof ApiProblem &&
    error.status >= 400 &&
    error.status < 500 &&
    ![401, 408, 425, 429].includes(error.status)
  );
}
