/**
 * A whole run to look through: all of its poses, and its images without any, in the order of time.
 * Nothing is leased, so two people may look at the same; what counts for either is kept apart by
 * the server.
 */
import { call } from "../api";
import type { Feed, FeedState } from "./feed";
import { loadPoses } from "./pose-loader";
import type { PoseImage, ReviewSession } from "./session";

interface RunImage {
  readonly image: PoseImage;
  readonly complete: object | null;
}

interface RunImagePage {
  readonly items: readonly RunImage[];
  readonly next_cursor: string | null;
}

export class RunFeed implements Feed {
  readonly title = "All poses of the run";
  readonly unit = "pose";
  state: FeedState = "more";
  private graded = 0;
  private total = 0;

  constructor(
    private readonly runId: number,
    private readonly session: ReviewSession,
    private readonly onMore: () => void,
  ) {}

  async start(): Promise<void> {
    const pages = loadPoses(this.runId);
    const first = await pages.next();
    if (first.done !== true) {
      this.take(first.value);
    }
    void this.rest(pages);
  }

  moved(): void {
    // everything is on its way already
  }

  settled(): void {
    // nobody else's work is counted here
  }

  private async rest(pages: ReturnType<typeof loadPoses>): Promise<void> {
    for await (const poses of pages) {
      this.take(poses);
      this.onMore();
    }
    await this.takeImagesWithoutPoses();
    this.state = "drained";
    this.onMore();
  }

  private take(poses: Parameters<ReviewSession["take"]>[0]): void {
    this.session.take(poses, ({ review }) => review === null);
    this.total += poses.length;
    this.graded += poses.filter(({ review }) => review !== null).length;
    this.session.setExtent(this.unit, this.total, this.graded);
  }

  private async takeImagesWithoutPoses(): Promise<void> {
    let cursor: string | null = null;
    do {
      const query = new URLSearchParams({ has_poses: "false", limit: "200" });
      if (cursor !== null) {
        query.set("cursor", cursor);
      }
      const page = (await call(
        `/api/v1/runs/${this.runId}/images?${query.toString()}`,
      )) as RunImagePage;
      for (const { image, complete } of page.items) {
        this.session.takeImage(image, false);
        this.session.verdicts.tellComplete(image.id, complete !== null);
      }
      cursor = page.next_cursor;
    } while (cursor !== null);
    this.session.sortByTime();
  }
}
