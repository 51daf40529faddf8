/**
 * Acts on their way to the server. Each is written to the browser's storage in the same instant as
 * the key is pressed and leaves it only once the server has acknowledged it, so that neither a
 * closed tab nor a dead network nor a restarted server loses one; its idempotency key keeps it
 * single however often it is sent.
 *
 * They go one at a time in the order given, so that a second thought never arrives first. Of all
 * open tabs one sends at a time (a Web Lock, where the browser has them). When nothing answers, all
 * wait and try again, less and less often; when the server stumbles over one write again and again,
 * that one and its channel stand aside and the others go on.
 */
import { ApiProblem } from "../api";
import { SomebodyElse } from "./own-session";
import type { WriteStore } from "./write-store";
import type { PendingWrite, Write } from "./writes";

export type OutboxState = "idle" | "sending" | "offline" | "signed-out" | "somebody-else";

/** Runs a task while no other tab runs one. */
export type Exclusive = (task: () => Promise<void>) => Promise<void>;

export interface OutboxEvents {
  readonly onChange: (state: OutboxState, waiting: number) => void;
  /** The server has it; by another tab's sending the answer is not known (undefined). */
  readonly onSent: (write: PendingWrite, answer: unknown) => void;
  /** The server will never take this one; it is no longer waiting. */
  readonly onRefused: (write: PendingWrite, problem: ApiProblem) => void;
}

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 5_000;
/** After so many failures of one write while the server answers, others go first. */
const PATIENCE = 3;
/** Answers that say "not now" though they look like a refusal. */
const PASSING = [401, 408, 425, 429];

export class Outbox {
  private waiting: readonly PendingWrite[];
  private readonly failures = new Map<string, number>();
  private running = false;
  /** The last attempt got no answer that settles it: what is shown stays until one does. */
  private failing = false;
  private failedAs: OutboxState = "offline";
  private sending: string | null = null;
  private delayMs = FIRST_DELAY_MS;
  private wake: (() => void) | null = null;

  constructor(
    private readonly store: WriteStore,
    private readonly send: (write: PendingWrite) => Promise<unknown>,
    private readonly events: OutboxEvents,
    private readonly exclusively: Exclusive = exclusive,
  ) {
    this.waiting = store.all();
  }

  /** What the server has not acknowledged yet, oldest first. */
  get pending(): readonly PendingWrite[] {
    return this.waiting;
  }

  /** Keeps a write and sends it when its turn comes. */
  add(write: Write): PendingWrite {
    const pending = this.store.add(write);
    this.waiting = [...this.waiting, pending];
    this.flush();
    return pending;
  }

  /** Starts sending, or tries again at once if it was waiting for better times. */
  flush(): void {
    if (this.running) {
      this.wake?.();
    } else {
      void this.run();
    }
  }

  /** Another tab has added or sent something. */
  reread(): void {
    const stored = this.store.all();
    const keys = new Set(stored.map(({ key }) => key));
    const gone = this.waiting.filter(({ key }) => !keys.has(key) && key !== this.sending);
    this.waiting = stored;
    for (const write of gone) {
      this.events.onSent(write, undefined);
    }
    if (stored.length > 0) {
      this.flush();
    } else if (!this.running) {
      this.events.onChange("idle", 0);
    }
  }

  private async run(): Promise<void> {
    this.running = true;
    while (this.waiting.length > 0) {
      this.events.onChange(this.failing ? this.failedAs : "sending", this.waiting.length);
      await this.exclusively(async () => {
        await this.deliverAll();
      });
      if (this.waiting.length > 0) {
        await this.pause();
      }
    }
    this.running = false;
    this.events.onChange("idle", 0);
  }

  /** Sends until nothing is left or the server cannot be had. */
  private async deliverAll(): Promise<void> {
    this.waiting = this.store.all(); // other tabs had their turn
    let write = this.next(new Set());
    const aside = new Set<string>();
    while (write !== undefined) {
      if (!(await this.deliver(write))) {
        if ((this.failures.get(write.key) ?? 0) < PATIENCE) {
          return;
        }
        aside.add(write.channel);
      }
      write = this.next(aside);
    }
  }

  private next(aside: ReadonlySet<string>): PendingWrite | undefined {
    return this.waiting.find(({ channel }) => !aside.has(channel));
  }

  /** Sends one write; false when it has to be tried again. */
  private async deliver(write: PendingWrite): Promise<boolean> {
    if (!this.store.has(write)) {
      this.forget(write);
      return true; // sent by another tab in the meantime
    }
    this.sending = write.key;
    try {
      const answer = await this.send(write);
      this.forget(write);
      this.worked();
      this.events.onSent(write, answer);
      return true;
    } catch (error) {
      if (isFinal(error)) {
        this.forget(write);
        this.worked();
        this.events.onRefused(write, error);
        return true;
      }
      this.failed(write, error);
      return false;
    } finally {
      this.sending = null;
    }
  }

  private worked(): void {
    this.failing = false;
    this.delayMs = FIRST_DELAY_MS;
    if (this.waiting.length > 0) {
      this.events.onChange("sending", this.waiting.length);
    }
  }

  private failed(write: PendingWrite, error: unknown): void {
    if (error instanceof ApiProblem && error.status !== 401) {
      this.failures.set(write.key, (this.failures.get(write.key) ?? 0) + 1);
    }
    this.failing = true;
    this.failedAs = stateAfter(error);
    this.events.onChange(this.failedAs, this.waiting.length);
  }

  private forget(write: PendingWrite): void {
    this.store.remove(write);
    this.failures.delete(write.key);
    this.waiting = this.waiting.filter(({ key }) => key !== write.key);
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
}

function stateAfter(error: unknown): OutboxState {
  if (error instanceof SomebodyElse) {
    return "somebody-else";
  }
  return error instanceof ApiProblem && error.status === 401 ? "signed-out" : "offline";
}

/** Whether sending the same again can never succeed. */
function isFinal(error: unknown): error is ApiProblem {
  // Anything else than the server's own words (no network, a captive portal's page) may pass.
  if (!(error instanceof ApiProblem) || error.status < 400 || error.status >= 500) {
    return false;
  }
  // A conflict that names no field: the very same write is under way, its answer comes next time.
  const underWay = error.status === 409 && error.fields.length === 0;
  return !underWay && !PASSING.includes(error.status);
}

const LOCK = "quaymark.outbox";

/** One tab at a time; without Web Locks (plain HTTP in a LAN) the idempotency keys have to do. */
async function exclusive(task: () => Promise<void>): Promise<void> {
  const locks = (navigator as { locks?: LockManager }).locks;
  await (locks === undefined ? task() : locks.request(LOCK, task));
}
