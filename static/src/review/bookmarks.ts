/** Which stops this person marked: what was pressed here, else what the server says of the pose. */
import type { ReviewSession, Stop } from "./session";

export class Bookmarks {
  private readonly pressed = new Map<string, boolean>();

  constructor(private readonly session: ReviewSession) {}

  has(stop: Stop): boolean {
    const pose = stop.pose === null ? null : this.session.pose(stop.pose.id);
    return this.pressed.get(stop.key) ?? pose?.bookmarked ?? false;
  }

  /** Marks a stop, or takes the mark away; returns whether it is marked now. */
  toggle(stop: Stop): boolean {
    const on = !this.has(stop);
    this.pressed.set(stop.key, on);
    return on;
  }
}
