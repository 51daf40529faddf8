/**
 * Follows a run: server-sent events while they flow, polling where something between browser and
 * server swallows them. Ends by itself when the run has ended.
 */
import { call } from "../api";
import { hasEnded, type RunProgress } from "./progress";

const POLL_MS = 2000;
/** Without any event for so long the stream is taken for dead. */
const SILENCE_MS = 6000;

export class RunWatch {
  private stream: EventSource | null = null;
  private timer: number | undefined;
  private ended = false;

  constructor(
    private readonly url: string,
    private readonly onProgress: (progress: RunProgress) => void,
    private readonly onEnd: (progress: RunProgress) => void,
  ) {}

  start(): void {
    this.stream = new EventSource(`${this.url}/events`);
    this.stream.addEventListener("progress", (event: MessageEvent<string>) => {
      this.take(JSON.parse(event.data) as RunProgress);
    });
    this.stream.addEventListener("error", () => {
      this.pollLater(POLL_MS);
    });
    this.pollLater(SILENCE_MS);
  }

  private take(progress: RunProgress): void {
    if (this.ended) {
      return;
    }
    this.onProgress(progress);
    if (hasEnded(progress.status)) {
      this.ended = true;
      this.stream?.close();
      window.clearTimeout(this.timer);
      this.onEnd(progress);
    } else {
      this.pollLater(SILENCE_MS);
    }
  }

  private pollLater(delayMs: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      void this.poll();
    }, delayMs);
  }

  private async poll(): Promise<void> {
    try {
      this.take((await call(this.url)) as RunProgress);
    } catch {
      // The next poll tells; the page keeps showing what it last knew.
    }
    if (!this.ended) {
      this.pollLater(POLL_MS);
    }
  }
}
