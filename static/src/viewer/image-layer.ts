/**
 * The photograph under the overlay: the preview first, the full resolution as soon as it is
 * decoded. Only this layer is transformed; the overlay stays in screen pixels.
 */
import type { ImageCache } from "./image-cache";
import type { Size, View } from "./view";

export interface ImageSource {
  readonly previewUrl: string;
  readonly fullUrl: string;
  readonly size: Size;
  readonly description: string;
}

/** From this scale on single pixels are shown as squares. */
const PIXELS_SHOWN_FROM = 5;

export type Sharpness = "empty" | "preview" | "full" | "failed";

export class ImageLayer {
  private source: ImageSource | null = null;
  private shown: HTMLImageElement | null = null;
  private sharpness: Sharpness = "empty";

  constructor(
    private readonly parent: HTMLElement,
    private readonly previews: ImageCache,
    private readonly fulls: ImageCache,
    private readonly onChange: (sharpness: Sharpness) => void,
  ) {}

  show(source: ImageSource): void {
    if (this.source?.fullUrl === source.fullUrl && this.sharpness !== "failed") {
      this.source = source;
      if (this.shown !== null) {
        this.shown.alt = source.description;
      }
      return;
    }
    this.source = source;
    const full = this.fulls.ready(source.fullUrl);
    if (full !== null) {
      void this.fulls.load(source.fullUrl); // keeps it young
      this.put(source, full, "full");
      return;
    }
    const preview = this.previews.ready(source.previewUrl);
    if (preview === null) {
      this.clear();
      this.place(source, this.previews.load(source.previewUrl), "preview");
    } else {
      this.put(source, preview, "preview");
    }
    this.place(source, this.fulls.load(source.fullUrl), "full");
  }

  transform(view: View): void {
    if (this.shown === null) {
      return;
    }
    this.shown.style.transform = `translate(${view.x}px, ${view.y}px) scale(${view.scale})`;
    this.shown.classList.toggle("shows-pixels", view.scale >= PIXELS_SHOWN_FROM);
  }

  private place(
    source: ImageSource,
    loading: Promise<HTMLImageElement>,
    sharpness: "preview" | "full",
  ): void {
    loading.then(
      (image) => {
        const late = this.source?.fullUrl !== source.fullUrl || this.sharpness === "full";
        if (!late) {
          this.put(this.source ?? source, image, sharpness);
        }
      },
      () => {
        if (this.source?.fullUrl === source.fullUrl && this.sharpness === "empty" && sharpness === "full") {
          this.report("failed");
        }
      },
    );
  }

  private put(source: ImageSource, image: HTMLImageElement, sharpness: "preview" | "full"): void {
    image.className = "viewer__image";
    image.alt = source.description;
    image.style.width = `${source.size.width}px`;
    image.style.height = `${source.size.height}px`;
    if (this.shown === null) {
      this.parent.prepend(image);
    } else if (this.shown !== image) {
      this.shown.replaceWith(image);
    }
    this.shown = image;
    this.report(sharpness);
  }

  private clear(): void {
    this.shown?.remove();
    this.shown = null;
    this.report("empty");
  }

  private report(sharpness: Sharpness): void {
    this.sharpness = sharpness;
    this.onChange(sharpness);
  }
}
