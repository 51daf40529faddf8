/**
 * The mathematics of looking at an image: where each of its points stands on the screen.
 *
 * Two coordinate systems meet here. Geometry speaks of pixel centres: (0, 0) is the centre of the
 * first pixel. CSS and SVG speak of pixel corners: (0, 0) is the outer corner of the first pixel.
 * Half a pixel lies between them, and it is added and taken away here only. A view maps corner
 * coordinates of the image to CSS pixels of the viewer by one scale and one offset, never rounded.
 */

export type Point = readonly [x: number, y: number];

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** A rectangle in geometry's pixels (pixel centres). */
export interface Rect {
  readonly x1: number;
  readonly y1: number;
  readonly x2: number;
  readonly y2: number;
}

/** `screen = corner * scale + offset`, in CSS pixels of the viewer. */
export interface View {
  readonly scale: number;
  readonly x: number;
  readonly y: number;
}

export const MAX_SCALE = 64;
const HALF_PIXEL = 0.5;

/** Where a geometry point stands on the screen. */
export function toScreen(view: View, [u, v]: Point): Point {
  return [
    (u + HALF_PIXEL) * view.scale + view.x,
    (v + HALF_PIXEL) * view.scale + view.y,
  ];
}

/** The geometry point under a place on the screen. */
export function toImage(view: View, [x, y]: Point): Point {
  return [
    (x - view.x) / view.scale - HALF_PIXEL,
    (y - view.y) / view.scale - HALF_PIXEL,
  ];
}

/** The smallest scale allowed: the image at half of its fitted size, or one to one if it is tiny. */
export function minScale(image: Size, screen: Size): number {
  return Math.min(1, fitScale(image, screen) / 2);
}

/** Zooms by a factor so that what is under `at` (screen) stays under it. */
export function zoomAt(view: View, at: Point, factor: number, lowest: number): View {
  const scale = Math.min(MAX_SCALE, Math.max(lowest, view.scale * factor));
  const ratio = scale / view.scale;
  return { scale, x: at[0] - (at[0] - view.x) * ratio, y: at[1] - (at[1] - view.y) * ratio };
}

export function panBy(view: View, dx: number, dy: number): View {
  return { scale: view.scale, x: view.x + dx, y: view.y + dy };
}

/** Shows the whole image, centred. */
export function fitImage(image: Size, screen: Size): View {
  const scale = fitScale(image, screen);
  return {
    scale,
    x: (screen.width - image.width * scale) / 2,
    y: (screen.height - image.height * scale) / 2,
  };
}

/**
 * Shows a rectangle, centred, with free space around it: margin 1 leaves the rectangle's own size
 * free on each side. Small objects are not blown up beyond `maxScale`.
 */
export function fitRect(rect: Rect, screen: Size, margin: number, maxScale = 8): View {
  const width = Math.max(1, rect.x2 - rect.x1) * (1 + 2 * margin);
  const height = Math.max(1, rect.y2 - rect.y1) * (1 + 2 * margin);
  const scale = Math.min(maxScale, fitScale({ width, height }, screen));
  return centerOn({ scale, x: 0, y: 0 }, middle(rect), screen);
}

/** The same scale with a geometry point in the middle of the screen. */
export function centerOn(view: View, [u, v]: Point, screen: Size): View {
  return {
    scale: view.scale,
    x: screen.width / 2 - (u + HALF_PIXEL) * view.scale,
    y: screen.height / 2 - (v + HALF_PIXEL) * view.scale,
  };
}

/** Whether a rectangle lies wholly on the screen. */
export function isVisible(view: View, rect: Rect, screen: Size): boolean {
  const [left, top] = toScreen(view, [rect.x1, rect.y1]);
  const [right, bottom] = toScreen(view, [rect.x2, rect.y2]);
  return left >= 0 && top >= 0 && right <= screen.width && bottom <= screen.height;
}

/** Keeps some of the image on the screen: its edge never passes the middle of the screen. */
export function keepInSight(view: View, image: Size, screen: Size): View {
  const clamp = (offset: number, extent: number, room: number): number =>
    Math.min(room / 2, Math.max(room / 2 - extent * view.scale, offset));
  return {
    scale: view.scale,
    x: clamp(view.x, image.width, screen.width),
    y: clamp(view.y, image.height, screen.height),
  };
}

/** Leaves no room empty that the image could fill; an image smaller than the room is centred. */
export function fillScreen(view: View, image: Size, screen: Size): View {
  const place = (offset: number, extent: number, room: number): number =>
    extent <= room ? (room - extent) / 2 : Math.min(0, Math.max(room - extent, offset));
  return {
    scale: view.scale,
    x: place(view.x, image.width * view.scale, screen.width),
    y: place(view.y, image.height * view.scale, screen.height),
  };
}

/** Shifts the view as little as is needed to have a rectangle that fits wholly on the screen. */
export function bringOnScreen(view: View, rect: Rect, screen: Size): View {
  const [left, top] = toScreen(view, [rect.x1, rect.y1]);
  const [right, bottom] = toScreen(view, [rect.x2, rect.y2]);
  const shift = (from: number, to: number, room: number): number =>
    from < 0 ? -from : Math.min(0, room - to);
  return panBy(view, shift(left, right, screen.width), shift(top, bottom, screen.height));
}

export function middle(rect: Rect): Point {
  return [(rect.x1 + rect.x2) / 2, (rect.y1 + rect.y2) / 2];
}

/** The smallest rectangle around all finite points; null when there is none. */
export function boundsOf(points: readonly Point[]): Rect | null {
  const finite = points.filter(([u, v]) => Number.isFinite(u) && Number.isFinite(v));
  if (finite.length === 0) {
    return null;
  }
  const us = finite.map(([u]) => u);
  const vs = finite.map(([, v]) => v);
  return { x1: Math.min(...us), y1: Math.min(...vs), x2: Math.max(...us), y2: Math.max(...vs) };
}

export function union(a: Rect, b: Rect): Rect {
  return {
    x1: Math.min(a.x1, b.x1),
    y1: Math.min(a.y1, b.y1),
    x2: Math.max(a.x2, b.x2),
    y2: Math.max(a.y2, b.y2),
  };
}

function fitScale(extent: Size, screen: Size): number {
  return Math.min(screen.width / extent.width, screen.height / extent.height);
}
