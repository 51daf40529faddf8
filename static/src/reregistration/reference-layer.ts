/** The reference photograph laid over the new one, as transparent as the slider says. */
import type { Overlay } from "../viewer/viewer";
import type { Size, View } from "../viewer/view";

export class ReferenceLayer implements Overlay {
  private readonly images = new Map<string, HTMLImageElement>();
  private shown: HTMLImageElement | null = null;
  private view: View | null = null;
  private mix = 0;
  private difference = false;

  constructor(
    private readonly surface: HTMLElement,
    private readonly size: Size,
    private readonly urls: Readonly<Record<string, string>>,
  ) {}

  /** It draws an image beside the SVG, so it has no use for a group of its own. */
  attach(): void {
    return;
  }

  show(look: string): void {
    const image = this.image(look);
    if (this.shown !== image) {
      this.shown?.remove();
      this.shown = image;
      this.surface.insertBefore(image, this.surface.querySelector("svg"));
    }
    this.apply();
  }

  setMix(share: number, difference: boolean): void {
    this.mix = share;
    this.difference = difference;
    this.apply();
  }

  draw(view: View): void {
    this.view = view;
    this.apply();
  }

  private image(look: string): HTMLImageElement {
    const known = this.images.get(look);
    if (known !== undefined) {
      return known;
    }
    const image = new Image();
    image.src = this.urls[look] ?? "";
    image.alt = "";
    image.className = "viewer__image flick__reference";
    image.style.width = `${this.size.width}px`;
    image.style.height = `${this.size.height}px`;
    this.images.set(look, image);
    return image;
  }

  private apply(): void {
    if (this.shown === null || this.view === null) {
      return;
    }
    const { x, y, scale } = this.view;
    this.shown.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
    this.shown.style.opacity = String(this.mix);
    this.shown.style.mixBlendMode = this.difference ? "difference" : "normal";
  }
}
