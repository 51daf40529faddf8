/**
 * Photographs fetched and decoded ahead of their turn, so that the next one is sharp at once.
 *
 * An entry is an <img> that is decoded; the viewer puts that very element on the page, because a
 * second element with the same address may be decoded again.
 */

export class ImageCache {
  private readonly entries = new Map<string, Promise<HTMLImageElement>>();
  private readonly decoded = new Map<string, HTMLImageElement>();

  constructor(private readonly capacity: number) {}

  /** The decoded image if it is there already. */
  ready(url: string): HTMLImageElement | null {
    return this.decoded.get(url) ?? null;
  }

  /** Fetches and decodes; a failed image is forgotten, so that a later call tries again. */
  load(url: string): Promise<HTMLImageElement> {
    const known = this.entries.get(url);
    if (known !== undefined) {
      this.entries.delete(url);
      this.entries.set(url, known); // now the youngest
      return known;
    }
    const image = new Image();
    image.alt = "";
    image.decoding = "async";
    image.draggable = false;
    image.src = url;
    const loading = image.decode().then(
      () => {
        if (this.entries.has(url)) {
          this.decoded.set(url, image);
        }
        return image;
      },
      (error: unknown) => {
        this.entries.delete(url);
        throw error;
      },
    );
    this.entries.set(url, loading);
    this.forgetOldest();
    return loading;
  }

  private forgetOldest(): void {
    for (const url of this.entries.keys()) {
      if (this.entries.size <= this.capacity) {
        return;
      }
      this.entries.delete(url);
      this.decoded.delete(url);
    }
  }
}
