/** Fetches and decodes the photographs that will come next: full size near, previews farther. */
import type { Viewer } from "../viewer/viewer";
import type { ReviewSession } from "./session";

const FULLS_AHEAD = 3;
const PREVIEWS_AHEAD = 8;
const STOPS_AHEAD = 60;

export function prefetch(session: ReviewSession, viewer: Viewer): void {
  const images = new Map(session.upcoming(STOPS_AHEAD).map(({ image }) => [image.id, image]));
  images.delete(session.current?.image.id ?? -1);
  [...images.values()].slice(0, PREVIEWS_AHEAD).forEach((image, i) => {
    const loading =
      i < FULLS_AHEAD ? viewer.fulls.load(image.file_url) : viewer.previews.load(image.preview_url);
    loading.catch(() => undefined); // shown, with its error, when its turn comes
  });
}
