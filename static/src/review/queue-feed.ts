/**
 * A queue shared with others: items are leased a few ahead, so that the next one is here before it
 * is asked for; the leases are prolonged while the reviewer works and given back on leaving.
 */
import { call } from "../api";
import type { Feed, FeedState } from "./feed";
import type { Pose } from "./pose";
import { keyOf, keyOfImage, type PoseImage, type ReviewSession } from "./session";

export interface Queue {
  readonly id: number;
  readonly unit: "pose" | "image";
  readonly order: string;
  readonly double: boolean;
  readonly description: string;
  readonly progress: Progress;
}

interface Progress {
  readonly total: number;
  readonly done: number;
  readonly leased: number;
  readonly mine_leased: number;
}

interface QueueItem {
  readonly id: number;
  readonly pose: Pose | null;
  readonly image: PoseImage;
  readonly poses: readonly Pose[];
}

/** Enough for a hand that never stops, but no more than a share of what is left for all. */
const AHEAD = { least: 4, most: 12, share: 1 / 4 } as const;
const RECOUNT_EVERY_MS = 5_000;
const EXTEND_EVERY_MS = 120_000;
/** Without a key or a touch for so long the leases are left to run out. */
const ACTIVE_FOR_MS = 300_000;
/** When all that is left is held by others: they may give it back. */
const ASK_AGAIN_MS = 20_000;

export class QueueFeed implements Feed {
  state: FeedState = "more";
  /** Leased item by the key of its stop. */
  private readonly held = new Map<string, number>();
  private asking = false;
  private remaining: number;
  private recountedMs = 0;
  private lastActiveMs = Date.now();

  constructor(
    private readonly queue: Queue,
    private readonly session: ReviewSession,
    private readonly onMore: () => void,
    private readonly onTrouble: (error: unknown) => void,
  ) {
    this.remaining = queue.progress.total - queue.progress.done;
    session.setExtent(queue.unit, queue.progress.total, queue.progress.done);
    session.expectsOpinions = this.isDouble;
    session.isBlind = queue.double;
  }

  get title(): string {
    return this.queue.description;
  }

  get unit(): "pose" | "image" {
    return this.queue.unit;
  }

  /** In these queues a second opinion is what is asked for. */
  private get isDouble(): boolean {
    return this.queue.double || ["disagreement", "second_opinion"].includes(this.queue.order);
  }

  async start(): Promise<void> {
    // What this person's crashed or reloaded page had leased; but not what another tab works on.
    await this.ask(await holdAlone(`quaymark.queue.${this.queue.id}`));
    this.watch();
  }

  moved(): void {
    const low = Math.ceil((this.ahead * 2) / 3);
    const left = this.session.upcoming(low).length;
    if (left < low && this.state === "more" && !this.asking) {
      this.ask(false).then(this.onMore, this.onTrouble);
    }
  }

  settled(): void {
    if (Date.now() - this.recountedMs >= RECOUNT_EVERY_MS) {
      this.recountedMs = Date.now();
      this.recount().then(this.onMore, () => undefined); // the next time will do
    }
  }

  /** Others work on the same queue, and a page that was closed may just have been heard. */
  private async recount(): Promise<void> {
    const before = this.session.decided;
    const progress = await this.progress();
    if (this.session.decided === before) {
      this.session.setExtent(this.queue.unit, progress.total, progress.done - before);
    }
  }

  private async progress(): Promise<Progress> {
    return (await call(`${this.address}/progress`)) as Progress;
  }

  private get ahead(): number {
    const share = Math.ceil(this.remaining * AHEAD.share);
    return Math.min(AHEAD.most, Math.max(AHEAD.least, share));
  }

  private async ask(resume: boolean): Promise<void> {
    this.asking = true;
    try {
      const count = this.ahead - this.session.upcoming(this.ahead).length;
      const answer = (await call(`${this.address}/next`, {
        method: "POST",
        json: { count: Math.max(1, count), resume },
      })) as { readonly items: readonly QueueItem[] } | null;
      const items = answer?.items ?? [];
      for (const item of items) {
        this.take(item);
      }
      this.remaining -= items.length;
      this.state = items.length > 0 ? "more" : await this.stateWithoutMore();
    } finally {
      this.asking = false;
    }
  }

  private take(item: QueueItem): void {
    if (item.pose !== null) {
      this.held.set(keyOf(item.pose.id), item.id);
      this.session.take([item.pose], () => true);
      return;
    }
    this.held.set(keyOfImage(item.image.id), item.id);
    this.session.take(item.poses, ({ mine, review }) => (mine ?? this.standing(review)) === null);
    this.session.takeImage(item.image, true);
  }

  /** In a double review only one's own verdict settles anything. */
  private standing(review: Pose["review"]): Pose["review"] {
    return this.isDouble ? null : review;
  }

  private async stateWithoutMore(): Promise<FeedState> {
    const { leased, mine_leased: mine } = await this.progress();
    if (leased <= mine) {
      return "drained";
    }
    setTimeout(() => {
      this.ask(false).then(this.onMore, this.onTrouble);
    }, ASK_AGAIN_MS);
    return "waiting";
  }

  private watch(): void {
    const active = (): void => {
      this.lastActiveMs = Date.now();
    };
    for (const event of ["keydown", "pointerdown", "wheel"]) {
      window.addEventListener(event, active, { passive: true });
    }
    setInterval(() => {
      if (Date.now() - this.lastActiveMs < ACTIVE_FOR_MS) {
        this.extend();
      }
    }, EXTEND_EVERY_MS);
    window.addEventListener("pagehide", () => {
      this.release();
    });
  }

  private extend(): void {
    const items = this.openItems();
    if (items.length > 0) {
      void this.tell("extend", items);
    }
  }

  private release(): void {
    const items = this.openItems();
    if (items.length > 0) {
      void this.tell("release", items);
    }
  }

  private openItems(): readonly number[] {
    return [...this.held].filter(([key]) => this.session.isOpen(key)).map(([, id]) => id);
  }

  /** A lease lost on the way costs nothing: the grade then counts as a second opinion. */
  private async tell(what: "extend" | "release", items: readonly number[]): Promise<void> {
    try {
      await call(`${this.address}/${what}`, { method: "POST", json: { items }, keepalive: true });
    } catch {
      // it runs out by itself
    }
  }

  private get address(): string {
    return `/api/v1/review-queues/${this.queue.id}`;
  }
}

/** The run's queue of everything ungraded, made when it is first asked for. */
export async function queueOfRun(runId: number): Promise<Queue> {
  return (await call("/api/v1/review-queues", {
    method: "POST",
    json: { run_id: runId, reuse: true },
  })) as Queue;
}

export async function queueById(id: number): Promise<Queue> {
  return (await call(`/api/v1/review-queues/${id}`)) as Queue;
}

/** A tab that was just closed needs a moment to give its name back. */
const PATIENCE_MS = 400;

/** Whether this tab is the only one with a name; it keeps the name as long as it lives. */
async function holdAlone(name: string): Promise<boolean> {
  const locks = (navigator as { locks?: LockManager }).locks;
  if (locks === undefined) {
    return true;
  }
  return new Promise((resolve) => {
    const held = locks.request(name, { signal: AbortSignal.timeout(PATIENCE_MS) }, () => {
      resolve(true);
      return new Promise(() => undefined);
    });
    held.catch(() => {
      resolve(false);
    });
  });
}
