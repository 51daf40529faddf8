/**
 * Traffic over a Leaflet map, on canvases: tracks, drawn again only when they have moved on by
 * something, and vessels, drawn in every frame. They reach over the map's edges, so that panning
 * shows what is there before anything is drawn anew.
 *
 * A thousand tracks take longer to draw than a frame lasts. So while time plays they are drawn on a
 * hidden canvas, some in each frame, which takes the place of the other when it is complete.
 */
import L from "leaflet";
import { drawTracks, drawVessels, placeOf, type Frame, type Present, type Span } from "./drawing";
import { atMoment } from "./moment";
import { onThemeChange, paletteOf, type Palette } from "./palette";
import { Sprites } from "./sprites";
import type { Track, TrackStore } from "./track-store";

const BEYOND = 0.2;
const TILE_PX = 256;
const HIT_PX = 14;
/** Tracks grow by no more than this share of their window between two drawings. */
const STALE_SHARE = 1 / 240;
const STALE_MS = 200;
const POINTS_A_FRAME = 1200;

/** Tracks that are being drawn on the hidden canvas: of which time, and how many are done. */
interface Redrawing {
  readonly span: Span;
  readonly tracks: readonly Track[];
  next: number;
}

export class TrafficLayer {
  chosen: Track | null = null;
  /** Vessels not heard for longer are drawn faint, seconds; whoever follows waits for the next report. */
  quietS = 0;
  private present: readonly Present[] = [];
  private momentS = 0;
  private windowS = 0;
  private frame: Frame | null = null;
  private palette: Palette;
  private drawnS = Number.NaN;
  private drawnMs = 0;
  private sprites: Sprites;
  private redrawing: Redrawing | null = null;
  private tracks: CanvasRenderingContext2D;
  private hidden: CanvasRenderingContext2D;
  private readonly vessels: CanvasRenderingContext2D;

  constructor(
    private readonly map: L.Map,
    private readonly store: TrackStore,
  ) {
    this.tracks = canvasIn(map.getPanes().overlayPane);
    this.hidden = canvasIn(map.getPanes().overlayPane);
    this.hidden.canvas.style.visibility = "hidden";
    this.vessels = canvasIn(map.getPanes().overlayPane);
    this.palette = paletteOf(map.getContainer());
    this.sprites = new Sprites(this.palette, density());
    map.on("moveend zoomend resize", () => {
      this.reset();
    });
    map.on("move", () => {
      this.followFar();
    });
    onThemeChange(() => {
      this.palette = paletteOf(map.getContainer());
      this.sprites = new Sprites(this.palette, density());
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
    this.redrawing = null;
    this.show(this.momentS, this.windowS);
  }

  /** Tracks have grown: vessels are drawn at once, the lines with the next round. */
  changedInPart(): void {
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
    const span = { fromS: this.momentS - this.windowS, toS: this.momentS, silenceS: this.store.silenceS };
    if (Number.isNaN(this.drawnS)) {
      clear(this.tracks);
      drawTracks(this.tracks, frame, this.store.tracks, span, chosen, palette, 0, Infinity);
      this.drawn(this.momentS);
    } else if (isStale && this.redrawing === null) {
      clear(this.hidden);
      this.redrawing = { span, tracks: this.store.tracks, next: 0 };
      requestAnimationFrame(this.drawSome);
    }
    drawVessels(this.vessels, frame, this.present, chosen, palette, this.sprites, this.quietS);
  }

  private readonly drawSome = (): void => {
    const { frame, redrawing: now } = this;
    if (frame === null || now === null) {
      return; // all was drawn anew meanwhile
    }
    const { tracks, span } = now;
    now.next = drawTracks(this.hidden, frame, tracks, span, this.chosen, this.palette, now.next, POINTS_A_FRAME);
    if (now.next < tracks.length) {
      requestAnimationFrame(this.drawSome);
      return;
    }
    [this.tracks, this.hidden] = [this.hidden, this.tracks];
    this.tracks.canvas.style.visibility = "";
    this.hidden.canvas.style.visibility = "hidden";
    this.redrawing = null;
    this.drawn(span.toS);
  };

  private drawn(momentS: number): void {
    this.drawnS = momentS;
    this.drawnMs = performance.now();
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
    for (const pen of [this.tracks, this.hidden, this.vessels]) {
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

function density(): number {
  return Math.min(2, window.devicePixelRatio || 1);
}

function clear(pen: CanvasRenderingContext2D): void {
  pen.clearRect(0, 0, pen.canvas.width, pen.canvas.height);
}

/** Makes a canvas as large as its frame, sharp on every screen. */
function fit(pen: CanvasRenderingContext2D, { widthPx, heightPx }: Frame): void {
  const { canvas } = pen;
  const dense = density();
  const [width, height] = [Math.round(widthPx * dense), Math.round(heightPx * dense)];
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
    canvas.style.width = `${widthPx}px`;
    canvas.style.height = `${heightPx}px`;
  }
  pen.setTransform(dense, 0, 0, dense, 0, 0);
}
