/**
 * The screen on which people draw boxes: one drag and one key for each vessel.
 *
 * A drag makes a box without a class; the class's key stores it. Whoever drags the next box, or goes
 * on, without such a key means the class used last. Nothing waits for the server.
 */
import { explain } from "../api";
import { showFlash } from "../page/flashes";
import { element, part } from "../page/parts";
import { Keymap, keyNames } from "../review/keymap";
import { isLargeEnough, movedRect, rectBetween } from "../review/missed/missed-box";
import { MissedPointer, type Grip } from "../review/missed/missed-pointer";
import { DragPan } from "../viewer/gestures/drag-pan";
import { PinchZoom } from "../viewer/gestures/pinch-zoom";
import { ViewKeys } from "../viewer/gestures/view-keys";
import { WheelZoom } from "../viewer/gestures/wheel-zoom";
import { toImage, type Point, type Rect, type Size } from "../viewer/view";
import { Viewer } from "../viewer/viewer";
import { Board, type Act } from "./board";
import { BoxesOverlay } from "./boxes-overlay";
import { BOX_COMMANDS, CLASSES, STEPS } from "./commands";
import { hintFor, smallestAt } from "./hints";
import { BoxKeys } from "./keys";
import { boxOf, stepped, type Scene, type VesselClass } from "./scene";
import { BoxStore } from "./store";

const NEW_SHARE = 0.16;
/** Keys come in bursts: the last place is the one to store. */
const SETTLE_MS = 400;

export class DrawingScreen {
  private readonly board = new Board();
  private readonly overlay = new BoxesOverlay();
  private readonly viewer: Viewer;
  private readonly store: BoxStore;
  private readonly keymap = new Keymap();
  private scene: Scene | null = null;
  private isComplete = false;
  private lastClass: VesselClass = "ship";
  private nudged: { readonly rect: Rect; readonly timer: ReturnType<typeof setTimeout> } | null = null;

  constructor(private readonly root: HTMLElement) {
    this.viewer = new Viewer(part(root, "viewer"));
    this.viewer.setFraming("image");
    this.viewer.add(this.overlay);
    this.store = new BoxStore(
      (waiting) => {
        part(root, "sync").textContent = waiting === 0 ? "Saved" : "Saving";
      },
      (error) => {
        showFlash(`Not stored: ${explain(error)} The image is shown as it is on the server.`, "error");
        void this.open(this.scene?.image.id ?? 0);
      },
    );
    this.listen();
    window.addEventListener("beforeunload", (event) => {
      this.settle();
      if (!this.store.isIdle) {
        event.preventDefault();
      }
    });
  }

  /** Shows a photograph; the view stays where it was. */
  async open(imageId: number): Promise<void> {
    this.settle();
    try {
      const scene = await this.store.scene(imageId);
      this.scene = scene;
      this.isComplete = scene.ground_truth?.is_complete ?? false;
      this.board.reset(scene.boxes.map(boxOf));
      const { image } = scene;
      this.viewer.show(
        {
          previewUrl: image.preview_url,
          fullUrl: image.file_url,
          size: this.size,
          description: `Photograph ${image.file_name}`,
        },
        null,
      );
      history.replaceState(null, "", `/images/${image.id}/boxes`);
      this.show();
      this.announce(`${image.file_name}, ${scene.boxes.length} boxes`);
      void this.prefetch(scene);
    } catch (error) {
      showFlash(`The photograph could not be loaded. ${explain(error)}`, "error");
    }
  }

  act(commandId: string, fine: boolean): void {
    const number = /^boxes\.class-(\d)$/.exec(commandId)?.[1];
    const step = STEPS.get(commandId);
    if (number !== undefined) {
      this.giveClass(CLASSES[Number(number) - 1] ?? "ship");
    } else if (step !== undefined) {
      this.step(step, fine ? 0.1 : 1);
    } else {
      this.actOn(commandId);
    }
  }

  private actOn(commandId: string): void {
    const { scene, board } = this;
    switch (commandId) {
      case "boxes.new":
        this.settle();
        board.chosen = null;
        board.pending = this.newRect();
        break;
      case "boxes.next-box":
      case "boxes.previous-box":
        this.settle();
        board.chooseBy(commandId === "boxes.next-box" ? 1 : -1);
        if (board.chosen !== null) {
          this.viewer.reveal(board.chosen.rect);
        }
        break;
      case "boxes.delete":
        this.remove();
        break;
      case "boxes.undo":
        this.undo();
        break;
      case "boxes.leave":
        board.pending = null;
        this.settle();
        board.chosen = null;
        break;
      case "boxes.fit":
        this.viewer.setFraming("image");
        break;
      case "boxes.complete":
        this.complete(true);
        this.go(scene?.next_open_id ?? scene?.later_id ?? null);
        break;
      case "boxes.reopen":
        this.complete(false);
        break;
      case "boxes.later":
        this.go(scene?.later_id ?? null);
        break;
      case "boxes.earlier":
        this.go(scene?.earlier_id ?? null);
        break;
      case "boxes.next-open":
        this.go(scene?.next_open_id ?? null);
        break;
    }
    this.show();
  }

  private get size(): Size {
    const image = this.scene?.image;
    return { width: image?.width_px ?? 1, height: image?.height_px ?? 1 };
  }

  private listen(): void {
    const { root, viewer } = this;
    new WheelZoom(viewer);
    new DragPan(viewer, () => undefined);
    new PinchZoom(viewer);
    new MissedPointer(viewer, {
      isActive: () => this.scene !== null,
      chosen: () => this.board.pending ?? this.board.chosen?.rect ?? null,
      onDrag: (grip, to) => {
        this.draw(this.after(grip, to), grip.kind === "draw");
      },
      onEnd: (grip, to) => {
        this.endDrag(grip, to);
      },
      onAbandon: () => {
        this.show();
      },
    });
    new BoxKeys(
      root,
      this.keymap,
      new ViewKeys(viewer, () => this.board.chosen !== null || this.board.pending !== null),
      (commandId, fine) => {
        this.act(commandId, fine);
      },
    );
    for (const command of BOX_COMMANDS) {
      for (const key of root.querySelectorAll(`[data-key-of="${command.id}"]`)) {
        key.textContent = keyNames(this.keymap, command)[0] ?? "";
      }
    }
  }

  private endDrag(grip: Grip, to: Point): void {
    const rect = this.after(grip, to);
    const { board } = this;
    if (grip.kind !== "draw") {
      if (isLargeEnough(rect)) {
        this.place(rect);
      }
    } else if (isLargeEnough(rect)) {
      this.settle();
      board.chosen = null;
      board.pending = rect;
      this.announce("New box. Which class?");
    } else {
      this.settle();
      board.chosen = smallestAt(board, to);
    }
    this.show();
  }

  private after(grip: Grip, to: Point): Rect {
    switch (grip.kind) {
      case "draw":
        return rectBetween(grip.from, to, this.size);
      case "stretch":
        return rectBetween(grip.fixed, to, this.size);
      case "move":
        return movedRect(grip.rect, to[0] - grip.from[0], to[1] - grip.from[1], this.size);
    }
  }

  private newRect(): Rect {
    const { clientWidth: width, clientHeight: height } = this.viewer.surface;
    const corner = (side: 1 | -1): Point =>
      toImage(this.viewer.currentView(), [
        (width / 2) * (1 + side * NEW_SHARE),
        (height / 2) * (1 + side * NEW_SHARE),
      ]);
    return rectBetween(corner(-1), corner(1), this.size);
  }

  /** Gives the pending or the chosen box a place. */
  private place(rect: Rect): void {
    const { board } = this;
    if (board.pending !== null) {
      board.pending = rect;
    } else if (board.chosen !== null) {
      this.send(board.change(board.chosen, rect, board.chosen.vesselClass));
    }
  }

  private step(by: readonly [number, number, number, number], share: number): void {
    const { board } = this;
    const [a, b, c, d] = by;
    const fine: readonly [number, number, number, number] = [a * share, b * share, c * share, d * share];
    if (board.pending !== null) {
      board.pending = stepped(board.pending, fine, this.size);
    } else if (board.chosen !== null) {
      const rect = stepped(this.nudged?.rect ?? board.chosen.rect, fine, this.size);
      clearTimeout(this.nudged?.timer);
      const timer = setTimeout(() => {
        this.settleNudge();
        this.show();
      }, SETTLE_MS);
      this.nudged = { rect, timer };
    }
    this.show();
  }

  private giveClass(vesselClass: VesselClass): void {
    const { board } = this;
    this.lastClass = vesselClass;
    if (board.pending !== null) {
      this.send(board.add(board.pending, vesselClass));
      board.chosen = null; // the next one may be drawn at once
      this.announce(`Stored: ${vesselClass}`);
    } else if (board.chosen !== null) {
      this.settleNudge();
      this.send(board.change(board.chosen, board.chosen.rect, vesselClass));
    }
    this.show();
  }

  /** Stores what is under way: a nudge, and a box without a class as one of the class used last. */
  private settle(): void {
    this.settleNudge();
    if (this.board.pending !== null) {
      this.send(this.board.add(this.board.pending, this.lastClass));
    }
  }

  private settleNudge(): void {
    const { nudged, board } = this;
    this.nudged = null;
    clearTimeout(nudged?.timer);
    if (nudged !== null && board.chosen !== null) {
      this.send(board.change(board.chosen, nudged.rect, board.chosen.vesselClass));
    }
  }

  private remove(): void {
    const { board } = this;
    clearTimeout(this.nudged?.timer);
    this.nudged = null;
    if (board.pending !== null) {
      board.pending = null;
    } else if (board.chosen !== null) {
      this.send(board.remove(board.chosen));
      this.announce("Deleted; Backspace brings it back.");
    }
  }

  private undo(): void {
    if (this.board.pending !== null) {
      this.board.pending = null;
      return;
    }
    this.settleNudge();
    const act = this.board.undo();
    if (act !== null) {
      this.send(act);
    }
  }

  private complete(isComplete: boolean): void {
    this.settle();
    if (this.scene !== null) {
      this.isComplete = isComplete;
      this.store.setComplete(this.scene.image.id, isComplete);
    }
  }

  private go(imageId: number | null): void {
    this.settle();
    if (imageId === null) {
      showFlash("There is no further image in this direction.", "info");
      return;
    }
    void this.open(imageId);
  }

  private send({ kind, box }: Act): void {
    switch (kind) {
      case "create":
        this.store.create(this.scene?.image.id ?? 0, box);
        break;
      case "change":
        this.store.change(box, { rect: box.rect, vesselClass: box.vesselClass });
        break;
      case "remove":
        this.store.remove(box);
        break;
      case "restore":
        this.store.restore(box);
        break;
    }
  }

  private draw(live: Rect | null, isNew: boolean): void {
    this.overlay.show(this.board.boxes, isNew ? null : this.board.chosen, live);
    this.viewer.requestRender();
  }

  private show(): void {
    const { board, root } = this;
    this.draw(board.pending ?? this.nudged?.rect ?? null, board.pending !== null);
    part(root, "place").textContent = this.scene?.image.file_name ?? "";
    part(root, "hint").textContent = hintFor(board, this.lastClass);
    for (const button of root.querySelectorAll<HTMLElement>("[data-class]")) {
      const wanted = board.chosen?.vesselClass ?? this.lastClass;
      button.setAttribute("aria-pressed", String(button.dataset["class"] === wanted));
    }
    part(root, "complete").setAttribute("aria-pressed", String(this.isComplete));
    part(root, "complete-words").textContent = this.isComplete ? "Complete" : "Boxes complete";
    part(root, "list").replaceChildren(...board.boxes.map((box, index) => {
      const button = element("button", "missed-row");
      button.type = "button";
      button.setAttribute("aria-pressed", String(box === board.chosen));
      button.append(element("span", "missed-row__number number", String(index + 1)), element("span", "", box.vesselClass));
      button.addEventListener("click", () => {
        this.settle();
        board.chosen = box;
        this.viewer.reveal(box.rect);
        this.show();
      });
      const item = element("li");
      item.append(button);
      return item;
    }));
  }

  private async prefetch({ next_open_id, later_id }: Scene): Promise<void> {
    const next = next_open_id ?? later_id;
    if (next === null) {
      return;
    }
    try {
      const { image } = await this.store.scene(next);
      await this.viewer.fulls.load(image.file_url);
    } catch {
      // It is loaded, with its error, when its turn comes.
    }
  }

  private announce(words: string): void {
    part(this.root, "announcement").textContent = words;
  }
}
