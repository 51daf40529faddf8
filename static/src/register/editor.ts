/**
 * The state of the registration editor and every way to change it.
 *
 * One list of points with its history, what is selected, which landmark waits for its pixel, the
 * newest solution. Screens listen and draw; gestures, keys and forms call the methods here. Nothing
 * here knows the page.
 */
import type { Camera, Intrinsics, Pixel } from "../geometry/camera";
import { isInImage } from "../geometry/camera";
import type { EnuFrame, Geodetic } from "../geometry/geodesy";
import { History } from "./model/history";
import {
  freeName,
  fromLandmark,
  isComplete,
  samePoints,
  type CompletePoint,
  type Landmark,
  type Point,
  type Points,
  type Role,
} from "./model/point";
import { WORST_FIRST, type Errors, type Sorting } from "./model/order";
import type { SolveAnswer } from "./api";

/** What does not change while the editor is open. */
export interface World {
  readonly frame: EnuFrame;
  readonly waterLevelM: number;
  readonly intrinsics: Intrinsics;
}

/** What the newest fit says: from the server at rest, from the browser during a drag. */
export interface Figures {
  readonly camera: Camera;
  readonly residualsPx: ReadonlyMap<string, Pixel>;
  readonly errors: ReadonlyMap<string, Errors>;
  readonly outliers: ReadonlySet<string>;
}

/** Which part of the editor has something new to show. */
export type Change = "points" | "selection" | "figures" | "answer" | "landmarks" | "saved" | "sorting";

export class Editor {
  sorting: Sorting = WORST_FIRST;
  figures: Figures | null = null;
  answer: SolveAnswer | null = null;
  landmarks: readonly Landmark[] = [];
  selectedKey: string | null = null;
  /** The landmark that the next click on the photograph places. */
  armed: Landmark | null = null;
  /** While a point is dragged the table keeps its order. */
  isDragging = false;
  version: number;
  saved: Points;
  private readonly history: History<Points>;
  private readonly listeners: ((changes: ReadonlySet<Change>) => void)[] = [];
  private pending: Set<Change> = new Set<Change>();

  constructor(
    readonly world: World,
    readonly mayEdit: boolean,
    saved: Points,
    version: number,
  ) {
    this.saved = saved;
    this.version = version;
    this.history = new History<Points>(saved);
  }

  get points(): Points {
    return this.history.state;
  }

  get complete(): readonly CompletePoint[] {
    return this.points.filter(isComplete);
  }

  get selected(): Point | null {
    return this.points.find(({ key }) => key === this.selectedKey) ?? null;
  }

  get undoLabel(): string | null {
    return this.history.undoLabel;
  }

  get redoLabel(): string | null {
    return this.history.redoLabel;
  }

  get isChanged(): boolean {
    return !samePoints(this.points, this.saved);
  }

  /**
   * Listeners are told once per frame what changed since they were last told. What one of them
   * changes meanwhile (the solver, the figures) reaches those after it in the same frame.
   */
  listen(listener: (changes: ReadonlySet<Change>) => void): void {
    this.listeners.push(listener);
  }

  tell(...changes: readonly Change[]): void {
    if (this.pending.size === 0) {
      requestAnimationFrame(() => {
        for (const listener of this.listeners) {
          listener(this.pending);
        }
        this.pending = new Set();
      });
    }
    for (const change of changes) {
      this.pending.add(change);
    }
  }

  edit(points: Points, label: string, stroke: string | null = null): void {
    if (this.mayEdit) {
      this.history.edit(points, label, stroke);
      this.tell("points");
    }
  }

  change(key: string, changes: Partial<Point>, label: string, stroke: string | null = null): void {
    const points = this.points.map((point) => (point.key === key ? { ...point, ...changes } : point));
    this.edit(points, label, stroke);
  }

  /** A click on the photograph: places the armed landmark, else begins a keypoint. */
  place(pixel: Pixel): Point | null {
    if (!this.mayEdit || !isInImage(this.world.intrinsics, pixel)) {
      return null;
    }
    const point = this.armed === null ? this.newPoint(pixel, null) : this.pointOf(this.armed, pixel);
    const others = this.points.filter(({ key }) => key !== point.key);
    this.armed = null;
    this.edit([...others, point], `place ${point.name}`);
    this.select(point.key);
    return point;
  }

  /** A click on the map: the place of the selected keypoint that has none, else a new one. */
  locate(place: Geodetic): void {
    const waiting = this.selected;
    if (!this.mayEdit) {
      return;
    }
    if (waiting !== null && waiting.place === null) {
      this.change(waiting.key, { place }, `locate ${waiting.name}`);
      return;
    }
    const point = this.newPoint(null, place);
    this.edit([...this.points, point], `add ${point.name}`);
    this.select(point.key);
  }

  /** A landmark was picked: it is what the waiting keypoint shows, or waits for its own click. */
  pick(landmark: Landmark): void {
    const existing = this.points.find(({ landmarkId }) => landmarkId === landmark.id);
    const waiting = this.selected;
    if (existing !== undefined && existing !== waiting) {
      this.arm(existing.pixel === null ? landmark : null);
      this.select(existing.key);
    } else if (this.mayEdit && waiting !== null && waiting.place === null) {
      const point = { ...fromLandmark(landmark, waiting.pixel), role: waiting.role };
      const points = this.points.map((other) => (other.key === waiting.key ? point : other));
      this.edit(points, `set ${landmark.name}`);
      this.select(point.key);
    } else if (this.mayEdit) {
      this.select(null);
      this.arm(landmark);
    }
  }

  /** Takes a projected landmark as a draft: it stands where it is seen and waits to be checked. */
  adopt(landmark: Landmark, pixel: Pixel): void {
    const point = { ...fromLandmark(landmark, pixel), role: "off" as const };
    const others = this.points.filter(({ landmarkId }) => landmarkId !== landmark.id);
    this.edit([...others, point], `adopt ${landmark.name}`);
    this.select(point.key);
  }

  movePixel(key: string, pixel: Pixel, stroke: string | null): void {
    const { widthPx, heightPx } = this.world.intrinsics;
    const inside: Pixel = [
      Math.min(widthPx - 0.5, Math.max(-0.5, pixel[0])),
      Math.min(heightPx - 0.5, Math.max(-0.5, pixel[1])),
    ];
    const name = this.points.find((point) => point.key === key)?.name ?? "";
    this.change(key, { pixel: inside }, `move ${name}`, stroke);
  }

  setRole(key: string, role: Role): void {
    const point = this.points.find((other) => other.key === key);
    if (point !== undefined && point.role !== role) {
      this.change(key, { role }, `make ${point.name} ${role}`);
    }
  }

  remove(key: string): void {
    const point = this.points.find((other) => other.key === key);
    if (point !== undefined) {
      this.edit(this.points.filter((other) => other !== point), `remove ${point.name}`);
      this.select(null);
    }
  }

  undo(): void {
    if (this.history.undo()) {
      this.tell("points", "selection");
    }
  }

  redo(): void {
    if (this.history.redo()) {
      this.tell("points", "selection");
    }
  }

  select(key: string | null): void {
    this.selectedKey = key;
    if (key !== null) {
      this.armed = null;
    }
    this.tell("selection");
  }

  arm(landmark: Landmark | null): void {
    this.armed = landmark;
    this.tell("selection");
  }

  /** The server's state after a save or a load; ids of new landmarks reach the whole history. */
  settle(saved: Points, version: number): void {
    const ids = new Map(saved.map((point) => [point.name, point]));
    const selectedName = this.selected?.name;
    this.history.amend((points) =>
      points.map((point) => {
        const known = ids.get(point.name);
        return known === undefined || point.landmarkId !== null
          ? point
          : { ...point, key: known.key, landmarkId: known.landmarkId };
      }),
    );
    this.saved = saved;
    this.version = version;
    this.selectedKey = this.points.find(({ name }) => name === selectedName)?.key ?? null;
    this.tell("points", "selection", "saved");
  }

  private newPoint(pixel: Pixel | null, place: Geodetic | null): Point {
    const names = [...this.points, ...this.landmarks].map(({ name }) => name);
    const key = `new-${crypto.getRandomValues(new Uint32Array(2)).join("-")}`;
    return { key, landmarkId: null, name: freeName(names), place, pixel, role: "control" };
  }

  private pointOf(landmark: Landmark, pixel: Pixel): Point {
    const existing = this.points.find(({ landmarkId }) => landmarkId === landmark.id);
    return existing === undefined ? fromLandmark(landmark, pixel) : { ...existing, pixel };
  }
}
