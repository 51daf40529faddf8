/**
 * Traffic over a Leaflet map, on two canvases: tracks, drawn again only when they have moved on by
 * something, and vessels, drawn in every frame. Both reach over the map's edges, so that panning
 * shows what is there before anything is drawn anew.
 */
import L from "leaflet";
import { drawTracks, drawVessels, placeOf, type Frame, type Present } from "./drawing";
import { atMoment } from "./moment";
import { onThemeChange, paletteOf, type Palette } from "./palette";
import type { Track, TrackStore } from "./track-store";

const BEYOND = 0.25;
const TILE_PX = 256;
const HIT_PX = 14;
/** Tracks grow by no more than this share of their window between two drawings. */
const STALE_SHARE = 1 / 240;
const STALE_MS = 200;

export class TrafficLayer {
  chosen: Track | null = null;
  private present: readonly Present[] = [];
  private momentS = 0;
  private windowS = 0;
  private frame: Frame | null = null;
  private palette: Palette;
  private drawnS = Number.NaN;
  private drawnMs = 0;
  private readonly tracks: CanvasRenderingContext2D;
  private readonly vessels: CanvasRenderingContext2D;

  constructor(
    private readonly map: L.Map,
    private readonly store: TrackStore,
  ) {
    this.tracks = canvasIn(map.getPanes().overlayPane);
    this.vessels = canvasIn(map.getPanes().overlayPane);
    this.palette = paletteOf(map.getContainer());
    map.on("moveend zoomend resize", () => {
      this.reset();
    });
    map.on("move", () => {
      this.followFar();
    });
    onThemeChange(() => {
      this.palette = paletteOf(map.getContainer());
      this.changed();
    });
    this.reset();
  }

  /** The vessels at the moment, in sight or not. */
  get vesselsNow(): readonly Present[] {
    return this.present;
  }

  show(momentS: number, windowS: number): void {
    this.momentS = momentS;
    this.windowS = windowS;
    const present: Present[] = [];
    for (const track of this.store.tracks) {
      const at = atMoment(track, momentS, this.store.silenceS);
      if (at !== null) {
        present.push({ track, at });
      }
    }
    this.present = present;
    this.draw();
  }

  /** Draws all anew: other tracks, another choice, another theme. */
  changed(): void {
    this.drawnS = Number.NaN;
    this.show(this.momentS, this.windowS);
  }

  /** The vessel at a place of the map's container. */
  hit({ x, y }: L.Point): Track | null {
    const { frame } = this;
    if (frame === null) {
      return null;
    }
    const corner = this.map.containerPointToLayerPoint([0, 0]).add(this.map.getPixelOrigin());
    const near = this.present
      .map(({ track, at }) => {
        const [left, top] = placeOf(frame, at);
        const away = Math.hypot(left + frame.leftPx - corner.x - x, top + frame.topPx - corner.y - y);
        return { track, away };
      })
      .filter(({ away }) => away <= HIT_PX)
      .sort((a, b) => a.away - b.away);
    return near[0]?.track ?? null;
  }

  private draw(): void {
    const { frame, palette, chosen } = this;
    if (frame === null) {
      return;
    }
    const moved = Math.abs(this.momentS - this.drawnS);
    const isStale = !(moved < this.windowS * STALE_SHARE) && performance.now() - this.drawnMs > STALE_MS;
    if (Number.isNaN(this.drawnS) || isStale) {
      const span = {
        fromS: this.momentS - this.windowS,
        toS: this.momentS,
        silenceS: this.store.silenceS,
      };
      drawTracks(this.tracks, frame, this.store.tracks, span, chosen, palette);
      this.drawnS = this.momentS;
      this.drawnMs = performance.now();
    }
    drawVessels(this.vessels, frame, this.present, chosen, palette);
  }

  /** Draws during a long pan too, before its edge comes into sight. */
  private followFar(): void {
    const { frame } = this;
    if (frame === null) {
      return;
    }
    const corner = this.map.containerPointToLayerPoint([0, 0]).add(this.map.getPixelOrigin());
    const size = this.map.getSize();
    const isOut =
      corner.x < frame.leftPx ||
      corner.y < frame.topPx ||
      corner.x + size.x > frame.leftPx + frame.widthPx ||
      corner.y + size.y > frame.topPx + frame.heightPx;
    if (isOut) {
      this.reset();
    }
  }

  private reset(): void {
    const size = this.map.getSize();
    const beyond = size.multiplyBy(BEYOND).round();
    const corner = this.map.containerPointToLayerPoint([0, 0]).subtract(beyond);
    const origin = this.map.getPixelOrigin();
    this.frame = {
      worldPx: TILE_PX * 2 ** this.map.getZoom(),
      leftPx: corner.x + origin.x,
      topPx: corner.y + origin.y,
      widthPx: size.x + 2 * beyond.x,
      heightPx: size.y + 2 * beyond.y,
    };
    for (const pen of [this.tracks, this.vessels]) {
      fit(pen, this.frame);
      L.DomUtil.setPosition(pen.canvas, corner);
    }
    this.changed();
  }
}

function canvasIn(pane: HTMLElement): CanvasRenderingContext2D {
  const canvas = document.createElement("canvas");
  canvas.className = "traffic-canvas";
  pane.append(canvas);
  const pen = canvas.getContext("2d");
  if (pen === null) {
    throw new Error("This browser cannot draw on a canvas.");
  }
  return pen;
}

/** Makes a canvas as large as its frame, sharp on every screen. */
function fit(pen: CanvasRenderingContext2D, { widthPx, heightPx }: Frame): void {
  const { canvas } = pen;
  const dense = Math.min(2, window.devicePixelRatio || 1);
  const [width, height] = [Math.round(widthPx * dense), Math.round(heightPx * dense)];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    canvas.style.width = `${widthPx}px`;
    canvas.style.height = `${heightPx}px`;
  }
  pen.setTransform(dense, 0, 0, dense, 0, 0);
}
