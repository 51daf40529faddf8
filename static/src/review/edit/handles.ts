/**
 * The handles of the box: one for each thing that can be changed, for mouse, finger and keyboard.
 *
 * They are HTML on top of the drawing, so that each has a hit area of its own size, the focus and a
 * name that says its value. Dragging the box itself moves it on the water.
 */
import type { Camera } from "../../geometry/camera";
import { element } from "../../page/parts";
import { boundsOf, toImage, toScreen, type Point, type View } from "../../viewer/view";
import type { Overlay, Viewer } from "../../viewer/viewer";
import { linePath } from "../../viewer/overlay/paths";
import { Lines } from "../../viewer/overlay/lines";
import { projectBox, type LocalBox } from "./box";
import { gripPixel, HANDLES, handlePixel, type Handle } from "./drag";
import { spread } from "./spread";

/** Pixels on the screen: off the box, and from each other. */
const OFFSET_PX = 22;
const APART_PX = 40;

interface HandleWords {
  readonly name: string;
  readonly tip: string;
  /** The slider's value and its words. */
  value(box: LocalBox): readonly [value: number, words: string, least: number, most: number];
}

const size = (
  name: string,
  tip: string,
  key: "length_m" | "width_m" | "height_m",
  most: number,
): HandleWords => ({
  name,
  tip,
  value: (box) => [box[key], `${box[key].toFixed(1)} m`, 0.5, most],
});

const WORDS: Readonly<Record<Handle, HandleWords>> = {
  move: {
    name: "Place on the water",
    tip: "Move on the water",
    value: (box) => [
      Math.hypot(box.east_m, box.north_m),
      `${Math.hypot(box.east_m, box.north_m).toFixed(1)} m from the generated place`,
      0,
      10_000,
    ],
  },
  turn: {
    name: "Heading",
    tip: "Turn",
    value: (box) => [box.heading_deg, `${box.heading_deg.toFixed(1)} degrees`, 0, 360],
  },
  bow: size("Length, by the bow", "Bow", "length_m", 600),
  stern: size("Length, by the stern", "Stern", "length_m", 600),
  port: size("Width, by the port side", "Port", "width_m", 120),
  starboard: size("Width, by the starboard side", "Starboard", "width_m", 120),
  top: size("Height", "Height", "height_m", 150),
};

export interface HandleHooks {
  onGrip(handle: Handle, at: Point): void;
  /** The pointer has come to this place of the image. */
  onDrag(at: Point): void;
  onRelease(): void;
  /** An arrow key on a focused handle: more or less, finely or not. */
  onNudge(handle: Handle, sign: 1 | -1, fine: boolean): void;
}

export class Handles implements Overlay {
  private readonly layer = element("div", "handles");
  private readonly handles = new Map<Handle, HTMLElement>();
  private leaders: Lines | null = null;
  private leaderGroup: SVGGElement | null = null;
  private shown: { readonly camera: Camera; readonly box: LocalBox } | null = null;
  private places: ReadonlyMap<Handle, Point> = new Map();
  private gripped: number | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly hooks: HandleHooks,
  ) {
    this.layer.hidden = true;
    for (const handle of HANDLES) {
      this.layer.append(this.make(handle));
    }
    viewer.surface.append(this.layer);
    // Before the viewer's own gestures: a grip on the box is not a pan.
    viewer.surface.addEventListener("pointerdown", this.onDown, { capture: true });
    viewer.surface.addEventListener("pointermove", this.onMove, { capture: true });
    for (const ending of ["pointerup", "pointercancel"] as const) {
      viewer.surface.addEventListener(ending, this.onUp, { capture: true });
    }
  }

  attach(group: SVGGElement): void {
    this.leaders = new Lines(group);
    this.leaderGroup = this.leaders.group("handle-leaders");
    for (const handle of HANDLES) {
      this.leaders.add(this.leaderGroup, "layer-handle", (view) => this.leader(handle, view));
    }
  }

  show(camera: Camera, box: LocalBox): void {
    this.shown = { camera, box };
    this.layer.hidden = false;
    for (const [handle, made] of this.handles) {
      const [value, words, least, most] = WORDS[handle].value(box);
      made.setAttribute("aria-valuemin", String(least));
      made.setAttribute("aria-valuemax", String(most));
      made.setAttribute("aria-valuenow", value.toFixed(1));
      made.setAttribute("aria-valuetext", words);
    }
    this.viewer.requestRender();
  }

  hide(): void {
    this.shown = null;
    this.gripped = null;
    this.layer.hidden = true;
    this.viewer.requestRender();
  }

  draw(view: View): void {
    this.place(view);
    for (const [handle, made] of this.handles) {
      const at = this.places.get(handle);
      made.hidden = at === undefined;
      if (at !== undefined) {
        made.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
      }
    }
    this.leaders?.draw(view);
  }

  private place(view: View): void {
    if (this.shown === null || this.gripped !== null) {
      // While one is dragged they go along with the box, but keep their places to each other.
      this.places = this.shown === null ? new Map() : this.follow(view);
      return;
    }
    const anchors = HANDLES.flatMap((name) => {
      const at = this.anchor(name, view);
      return at === null ? [] : [{ name, at }];
    });
    const bounds = boundsOf(anchors.map(({ at }) => at));
    const middle: Point =
      bounds === null ? [0, 0] : [(bounds.x1 + bounds.x2) / 2, (bounds.y1 + bounds.y2) / 2];
    this.places = spread(anchors, middle, OFFSET_PX, APART_PX);
    this.offsets = new Map(
      anchors.map(({ name, at }) => {
        const place = this.places.get(name) ?? at;
        return [name, [place[0] - at[0], place[1] - at[1]] as const];
      }),
    );
  }

  private offsets: ReadonlyMap<Handle, Point> = new Map();

  private follow(view: View): ReadonlyMap<Handle, Point> {
    return new Map(
      HANDLES.flatMap((name): [Handle, Point][] => {
        const at = this.anchor(name, view);
        const [dx, dy] = this.offsets.get(name) ?? [0, 0];
        return at === null ? [] : [[name, [at[0] + dx, at[1] + dy]]];
      }),
    );
  }

  private anchor(handle: Handle, view: View): Point | null {
    if (this.shown === null) {
      return null;
    }
    const pixel = handlePixel(this.shown.camera, this.shown.box, handle);
    return pixel === null ? null : toScreen(view, pixel);
  }

  /** From the box to its handle. */
  private leader(handle: Handle, view: View): string {
    const place = this.places.get(handle);
    const { shown } = this;
    const from = shown === null ? null : gripPixel(shown.camera, shown.box, handle);
    return place === undefined || from === null ? "" : linePath([from, toImage(view, place)], view);
  }

  private make(handle: Handle): HTMLElement {
    const { name, tip } = WORDS[handle];
    const made = element("div", `handle handle--${handle}`);
    made.tabIndex = 0;
    made.dataset["handle"] = handle;
    made.setAttribute("role", "slider");
    made.setAttribute("aria-label", name);
    made.setAttribute("aria-valuenow", "0");
    made.append(element("span", "handle__grip"), element("span", "handle__name", tip));
    made.addEventListener("keydown", (event) => {
      const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if ((sign === 1 || sign === -1) && handle !== "move") {
        event.preventDefault(); // the arrows are the slider's own while it has the focus
        this.hooks.onNudge(handle, sign, event.shiftKey);
      }
    });
    this.handles.set(handle, made);
    return made;
  }

  private readonly onDown = (event: PointerEvent): void => {
    const handle = this.gripAt(event);
    if (handle === null || event.button !== 0 || this.gripped !== null) {
      return;
    }
    event.stopPropagation();
    event.preventDefault();
    this.handles.get(handle)?.focus({ preventScroll: true });
    this.viewer.surface.setPointerCapture(event.pointerId);
    this.gripped = event.pointerId;
    this.layer.classList.add("is-dragging");
    this.hooks.onGrip(handle, this.pixelOf(event));
  };

  private readonly onMove = (event: PointerEvent): void => {
    if (event.pointerId === this.gripped) {
      event.stopPropagation();
      this.hooks.onDrag(this.pixelOf(event));
    }
  };

  private readonly onUp = (event: PointerEvent): void => {
    if (event.pointerId === this.gripped) {
      event.stopPropagation();
      this.gripped = null;
      this.layer.classList.remove("is-dragging");
      this.hooks.onRelease();
      this.viewer.requestRender();
    }
  };

  /** The handle under the pointer; the box itself is the one that moves it. */
  private gripAt(event: PointerEvent): Handle | null {
    if (this.shown === null) {
      return null;
    }
    const over = event.target instanceof Element ? event.target.closest("[data-handle]") : null;
    const named = HANDLES.find((name) => over?.getAttribute("data-handle") === name);
    return named ?? (this.isOnBox(this.pixelOf(event)) ? "move" : null);
  }

  private isOnBox([u, v]: Point): boolean {
    const corners = this.shown === null ? [] : projectBox(this.shown.camera, this.shown.box);
    const bounds = boundsOf(corners);
    return (
      bounds !== null && u >= bounds.x1 && u <= bounds.x2 && v >= bounds.y1 && v <= bounds.y2
    );
  }

  private pixelOf(event: PointerEvent): Point {
    return toImage(this.viewer.currentView(), this.viewer.pointAt(event));
  }
}
