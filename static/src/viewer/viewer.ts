/**
 * An image to look at closely, with drawings on top that stay exact at any zoom.
 *
 * The viewer holds the view (scale and offset) and renders once per animation frame: it transforms
 * the photograph and lets each overlay redraw itself in screen pixels. Gestures live in their own
 * classes and reach the view through ViewControl only.
 */
import { DEFAULT_MARGIN, adjustMargin, frame, type Framing } from "./framing";
import { ImageCache } from "./image-cache";
import { ImageLayer, type ImageSource, type Sharpness } from "./image-layer";
import {
  fitImage,
  keepInSight,
  minScale,
  panBy,
  zoomAt,
  type Point,
  type Rect,
  type Size,
  type View,
} from "./view";

/** What a gesture may do. Points and distances are CSS pixels of the viewer. */
export interface ViewControl {
  readonly surface: HTMLElement;
  pointAt(event: { clientX: number; clientY: number }): Point;
  zoom(at: Point, factor: number): void;
  pan(dx: number, dy: number): void;
  /** One step closer (positive) or farther, about the middle or by the object's margin. */
  zoomStep(steps: number): void;
  resetFraming(): void;
}

/** Something drawn over the image; `group` is its own SVG group in screen pixels. */
export interface Overlay {
  /** Drawings with controls of their own are told to screen readers, others are not. */
  readonly hasControls?: boolean;
  attach(group: SVGGElement): void;
  draw(view: View): void;
}

const KEY_ZOOM = 1.25;
const SVG = "http://www.w3.org/2000/svg";

/** Decoded full photographs kept: 2560 x 1920 is 20 MB each. */
const FULLS_KEPT = 6;
const PREVIEWS_KEPT = 24;

export class Viewer implements ViewControl {
  readonly previews = new ImageCache(PREVIEWS_KEPT);
  readonly fulls = new ImageCache(FULLS_KEPT);
  private readonly svg: SVGSVGElement;
  private readonly images: ImageLayer;
  private readonly overlays: Overlay[] = [];
  private view: View = { scale: 1, x: 0, y: 0 };
  private imageSize: Size | null = null;
  private object: Rect | null = null;
  private framingNow: Framing = "object";
  private margin = DEFAULT_MARGIN;
  private screen: Size;
  private frameRequested = false;

  constructor(
    readonly surface: HTMLElement,
    private readonly onFraming: (framing: Framing) => void = () => undefined,
    onSharpness: (sharpness: Sharpness) => void = () => undefined,
  ) {
    this.screen = { width: surface.clientWidth, height: surface.clientHeight };
    this.svg = document.createElementNS(SVG, "svg");
    this.svg.classList.add("viewer__overlay");
    surface.append(this.svg);
    this.images = new ImageLayer(surface, this.previews, this.fulls, (sharpness) => {
      surface.dataset["sharpness"] = sharpness;
      onSharpness(sharpness);
      this.requestRender();
    });
    new ResizeObserver(() => {
      this.resize();
    }).observe(surface);
  }

  get framing(): Framing {
    return this.framingNow;
  }

  add(overlay: Overlay): void {
    const group = document.createElementNS(SVG, "g");
    if (overlay.hasControls !== true) {
      group.setAttribute("aria-hidden", "true");
    }
    this.svg.append(group);
    overlay.attach(group);
    this.overlays.push(overlay);
    this.requestRender();
  }

  /** Shows an image and the object to look at in it; the framing decides what is seen. */
  show(source: ImageSource, object: Rect | null): void {
    const first = this.imageSize === null;
    this.imageSize = source.size;
    this.object = object;
    if (first) {
      this.view = fitImage(source.size, this.screen);
    }
    this.images.show(source);
    this.reframe();
  }

  setFraming(framing: Framing): void {
    this.framingNow = framing;
    this.onFraming(framing);
    this.reframe();
  }

  /** Hides every drawing while the photograph alone should be seen. */
  setOverlayHidden(hidden: boolean): void {
    this.svg.classList.toggle("is-hidden", hidden);
  }

  pointAt(event: { clientX: number; clientY: number }): Point {
    const box = this.surface.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  zoom(at: Point, factor: number): void {
    if (this.imageSize !== null) {
      this.moveTo(zoomAt(this.view, at, factor, minScale(this.imageSize, this.screen)));
    }
  }

  pan(dx: number, dy: number): void {
    this.moveTo(panBy(this.view, dx, dy));
  }

  zoomStep(steps: number): void {
    if (this.framingNow === "object" && this.object !== null) {
      this.margin = adjustMargin(this.margin, -steps);
      this.reframe();
    } else {
      this.zoom([this.screen.width / 2, this.screen.height / 2], KEY_ZOOM ** steps);
    }
  }

  resetFraming(): void {
    this.margin = DEFAULT_MARGIN;
    this.setFraming("object");
  }

  currentView(): View {
    return this.view;
  }

  requestRender(): void {
    if (this.frameRequested) {
      return;
    }
    this.frameRequested = true;
    requestAnimationFrame(() => {
      this.frameRequested = false;
      this.render();
    });
  }

  /** Draws at once: for who is inside of an animation frame already. */
  render(): void {
    this.images.transform(this.view);
    for (const overlay of this.overlays) {
      overlay.draw(this.view);
    }
  }

  /** Moves the view as far as is needed to have a rectangle of the image in sight. */
  reveal(rect: Rect): void {
    if (this.imageSize !== null) {
      this.view = frame("free", this.view, rect, this.imageSize, this.screen, this.margin);
      this.requestRender();
    }
  }

  private moveTo(view: View): void {
    if (this.imageSize === null) {
      return;
    }
    this.view = keepInSight(view, this.imageSize, this.screen);
    if (this.framingNow !== "free") {
      this.framingNow = "free";
      this.onFraming("free");
    }
    this.requestRender();
  }

  private reframe(): void {
    if (this.imageSize !== null) {
      this.view = frame(
        this.framingNow,
        this.view,
        this.object,
        this.imageSize,
        this.screen,
        this.margin,
      );
    }
    this.requestRender();
  }

  private resize(): void {
    const before = this.screen;
    this.screen = { width: this.surface.clientWidth, height: this.surface.clientHeight };
    if (this.framingNow === "free") {
      // What was in the middle stays in the middle.
      const dx = (this.screen.width - before.width) / 2;
      this.view = panBy(this.view, dx, (this.screen.height - before.height) / 2);
    }
    this.reframe();
  }
}
