/**
 * Follows live traffic: asks every few seconds for what came since, and moves the clock on with now.
 *
 * The server's clock is what counts, since images and reports are dated by it. Nothing is asked for
 * while nobody sees the page; who comes back after long starts again with the tracks of now.
 */
import { call, explain } from "../api";
import type { Scope } from "./chunks";
import { formatted } from "./live-words";
import type { StretchJson } from "./track-store";

const EVERY_MS = 3_000;
const LONGEST_WAIT_MS = 30_000;
/** A page left open costs the server a twentieth of a core at most. */
const COST_SHARE = 20;
const TICK_MS = 1_000;
const AWAY_MS = 600_000;

/** As the server tells it (GET /sites/{id}/ais/tracks/new). */
export interface NewsJson extends StretchJson {
  readonly end: string;
  readonly after: number;
  readonly is_cut: boolean;
}

export interface Followed {
  /** What is loaded of the world; null before anything is. */
  scope(): Scope | null;
  /** Now, seconds since 1970. */
  moveTo(momentS: number): void;
  /** What came so far has to be loaded (again); what comes from now on will be told. */
  begin(): void;
  take(news: NewsJson): void;
  say(words: string): void;
}

export class Follower {
  isOn = false;
  private after: number | null = null;
  private aheadMs: number | null = null;
  private heardMs: number | null = null;
  private trouble = "";
  private failures = 0;
  private seenMs = Date.now();
  private asking: number | undefined;
  private ticking: number | undefined;
  private round = 0;

  constructor(
    private readonly siteId: number,
    private readonly followed: Followed,
  ) {
    document.addEventListener("visibilitychange", () => {
      if (!this.isOn) {
        return;
      }
      if (document.hidden) {
        this.seenMs = Date.now();
        this.rest();
      } else {
        this.wake(Date.now() - this.seenMs > AWAY_MS);
      }
    });
  }

  start(): void {
    this.isOn = true;
    this.trouble = "";
    this.heardMs = null;
    this.after = null;
    if (!document.hidden) {
      this.wake(true);
    }
  }

  stop(): void {
    this.isOn = false;
    this.rest();
    this.followed.say("");
  }

  private rest(): void {
    this.round += 1;
    window.clearTimeout(this.asking);
    window.clearInterval(this.ticking);
  }

  private wake(anew: boolean): void {
    this.rest();
    this.after = anew ? null : this.after;
    this.failures = 0;
    this.ticking = window.setInterval(() => {
      this.tick();
    }, TICK_MS);
    void this.ask(this.round);
  }

  private tick(): void {
    if (this.aheadMs !== null) {
      this.followed.moveTo((Date.now() + this.aheadMs) / 1000);
    }
    const quietS = this.heardMs === null ? null : (Date.now() - this.heardMs) / 1000;
    this.followed.say(this.trouble !== "" ? this.trouble : formatted(quietS));
  }

  private async ask(round: number): Promise<void> {
    const begun = performance.now();
    let news: NewsJson | null = null;
    try {
      news = (await call(this.address())) as NewsJson;
      this.trouble = "";
      this.failures = 0;
    } catch (error) {
      this.trouble = `No answer, trying again. ${explain(error)}`;
      this.failures += 1;
    }
    if (round !== this.round) {
      return; // stopped, or begun anew, meanwhile
    }
    let waitMs = Math.max(EVERY_MS, COST_SHARE * (performance.now() - begun));
    if (news !== null) {
      waitMs = this.took(news) ? waitMs : 0;
    } else {
      waitMs = Math.min(LONGEST_WAIT_MS, EVERY_MS * 2 ** this.failures);
    }
    this.tick();
    this.asking = window.setTimeout(() => void this.ask(round), Math.min(waitMs, LONGEST_WAIT_MS));
  }

  private address(): string {
    const query = new URLSearchParams();
    if (this.after !== null) {
      query.set("after", String(this.after));
      const box = this.followed.scope()?.box;
      if (box !== undefined) {
        query.set("bbox", box.map((degrees) => degrees.toFixed(5)).join(","));
      }
    }
    return `/api/v1/sites/${this.siteId}/ais/tracks/new?${query.toString()}`;
  }

  /** False where the next question has to begin anew. */
  private took(news: NewsJson): boolean {
    this.aheadMs = Date.parse(news.end) - Date.now();
    if (news.is_cut) {
      this.after = null;
      return false;
    }
    const isFirst = this.after === null;
    this.after = news.after;
    if (isFirst) {
      this.followed.moveTo(Date.parse(news.end) / 1000);
      this.followed.begin();
    } else if (news.vessels.length > 0) {
      this.heardMs = Date.now();
      this.followed.take(news);
    }
    return true;
  }
}
