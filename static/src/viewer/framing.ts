/**
 * What the viewer shows when the object of interest changes.
 *
 * Three framings: the object with a margin, the whole image, or the place and zoom that the person
 * chose by hand. The first two follow from one object to the next; the last survives as it is, and
 * is only shifted when the next object would be out of sight.
 */
import {
  bringOnScreen,
  centerOn,
  fillScreen,
  fitImage,
  fitRect,
  isVisible,
  middle,
  type Rect,
  type Size,
  type View,
} from "./view";

export type Framing = "object" | "image" | "free";

export const DEFAULT_MARGIN = 0.6;
const MARGIN_STEP = 1.3;
const MARGIN_RANGE = { least: 0.05, most: 6 } as const;

/** The view for an object under a framing; `current` is what is shown now. */
export function frame(
  framing: Framing,
  current: View,
  object: Rect | null,
  image: Size,
  screen: Size,
  margin: number,
): View {
  if (framing === "image" || object === null) {
    return framing === "free" ? current : fitImage(image, screen);
  }
  if (framing === "object") {
    // Room beside the photograph shows nothing, unless the object itself reaches out of it.
    return bringOnScreen(fillScreen(fitRect(object, screen, margin), image, screen), object, screen);
  }
  return isVisible(current, object, screen) ? current : centerOn(current, middle(object), screen);
}

/** A wider (positive steps) or tighter (negative steps) margin around the object. */
export function adjustMargin(margin: number, steps: number): number {
  const next = margin * MARGIN_STEP ** steps;
  return Math.min(MARGIN_RANGE.most, Math.max(MARGIN_RANGE.least, next));
}

