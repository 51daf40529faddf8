/**
 * A photograph with its boxes as REST gives them, and boxes as the page holds them.
 *
 * Ground truth counts pixels from the image's edge, as COCO does; the viewer's geometry counts from
 * the centre of the first pixel. Half a pixel lies between them, and it is added and taken here.
 */
import type { Rect } from "../viewer/view";

export type VesselClass = "ship" | "ship_leaving_frame" | "ship_moored" | "ship_partial" | "subvessel";

export interface Place {
  readonly x1_px: number;
  readonly y1_px: number;
  readonly x2_px: number;
  readonly y2_px: number;
}

export interface BoxOut extends Place {
  readonly id: number;
  readonly vessel_class: VesselClass;
  readonly version: number;
}

export interface Scene {
  readonly image: {
    readonly id: number;
    readonly file_name: string;
    readonly captured_at: string;
    readonly width_px: number;
    readonly height_px: number;
    readonly file_url: string;
    readonly preview_url: string;
  };
  readonly ground_truth: { readonly id: number; readonly is_complete: boolean } | null;
  readonly boxes: readonly BoxOut[];
  readonly earlier_id: number | null;
  readonly later_id: number | null;
  readonly next_open_id: number | null;
}

/** A box on the page; it has an id once it is stored. */
export interface Box {
  id: number | null;
  version: number;
  rect: Rect;
  vesselClass: VesselClass;
  isGone: boolean;
}

const HALF_PIXEL = 0.5;

export function boxOf(stored: BoxOut): Box {
  return {
    id: stored.id,
    version: stored.version,
    rect: {
      x1: stored.x1_px - HALF_PIXEL,
      y1: stored.y1_px - HALF_PIXEL,
      x2: stored.x2_px - HALF_PIXEL,
      y2: stored.y2_px - HALF_PIXEL,
    },
    vesselClass: stored.vessel_class,
    isGone: false,
  };
}

/** The place of a box for REST, to a hundredth of a pixel: finer than any hand. */
export function placeOf({ x1, y1, x2, y2 }: Rect): Place {
  const rounded = (value: number): number => Math.round((value + HALF_PIXEL) * 100) / 100;
  return { x1_px: rounded(x1), y1_px: rounded(y1), x2_px: rounded(x2), y2_px: rounded(y2) };
}

/** A box moved by pixels and stretched at its right and bottom edge, within the image. */
export function stepped(
  { x1, y1, x2, y2 }: Rect,
  [dx, dy, wider, higher]: readonly [number, number, number, number],
  size: { readonly width: number; readonly height: number },
): Rect {
  const [right, bottom] = [size.width - HALF_PIXEL, size.height - HALF_PIXEL];
  const [least, x, y] = [
    1,
    Math.min(right - x2, Math.max(-HALF_PIXEL - x1, dx)),
    Math.min(bottom - y2, Math.max(-HALF_PIXEL - y1, dy)),
  ];
  return {
    x1: x1 + x,
    y1: y1 + y,
    x2: Math.min(right, Math.max(x1 + x + least, x2 + x + wider)),
    y2: Math.min(bottom, Math.max(y1 + y + least, y2 + y + higher)),
  };
}
