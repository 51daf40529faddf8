/**
 * Missed-vessel mode: a person marks vessels that are seen but have no pose, and says why. The
 * paper's matching table counts them, so an image is complete only once all of them are here.
 */
import { ApiProblem, explain } from "../../api";
import { showFlash } from "../../page/flashes";
import { randomKey } from "../../random-key";
import { toImage, type Point, type Rect, type Size } from "../../viewer/view";
import type { Mode, Press } from "../modes";
import type { Scene, Stage } from "../stage";
import { MISSED_REASONS, type MissedReason, type MissedVessel } from "../surroundings";
import { MISSED_WORDS } from "../words";
import { contains, grownRect, isLargeEnough, movedRect, rectBetween } from "./missed-box";
import { BOX_STEPS, MISSED_COMMANDS } from "./missed-commands";
import { MissedOverlay } from "./missed-overlay";
import { MissedPanel } from "./missed-panel";
import { MissedPointer, type Grip } from "./missed-pointer";
import { changeMissed, deleteMissed, pixelsOf, rectOf, storeMissed } from "./missed-writes";

/** One step of a key, on the screen; with Shift a tenth. */
const STEP_PX = 10;
/** A new box by key takes this share of the view. */
const NEW_SHARE = 0.16;
/** Keys come in bursts: the last place is the one to store. */
const SETTLE_MS = 500;

/** The box that is chosen: a stored one, or one that has no reason yet. */
interface Chosen {
  readonly stored: MissedVessel | null;
  rect: Rect;
  readonly key: string;
}

export class MissedMode implements Mode {
  readonly name = "missed";
  readonly title = "Missed vessels";
  readonly hint = "Drag a box around a vessel without one, then pick the reason";
  readonly commands = MISSED_COMMANDS;
  private readonly overlay = new MissedOverlay();
  private readonly panel: MissedPanel;
  private scene: Scene | null = null;
  private chosen: Chosen | null = null;
  private settling: ReturnType<typeof setTimeout> | null = null;

  constructor(private readonly stage: Stage) {
    this.panel = new MissedPanel(stage.root, (id) => {
      this.choose(this.missed().find((vessel) => vessel.id === id) ?? null);
    });
    new MissedPointer(stage.viewer, {
      isActive: () => stage.machine.current === this,
      chosen: () => this.chosen?.rect ?? null,
      onDrag: (grip, to) => {
        this.drag(grip, to);
      },
      onEnd: (grip, to) => {
        this.endDrag(grip, to);
      },
      onAbandon: () => {
        this.show();
      },
    });
    stage.viewer.add(this.overlay);
  }

  enter(): boolean {
    this.scene = this.stage.scene();
    if (this.scene === null) {
      return false;
    }
    this.panel.open();
    this.stage.viewer.setFraming("image"); // what was missed is seldom beside the box
    this.stage.viewer.surface.focus({ preventScroll: true });
    this.choose(null);
    return true;
  }

  leave(): void {
    this.settleNow();
    this.scene = null;
    this.chosen = null;
    this.overlay.show(null);
    this.panel.close();
    this.stage.viewer.requestRender();
  }

  act(commandId: string, { fine }: Press): void {
    const reason = MISSED_REASONS.find((code) => commandId === `missed.${code}`);
    if (reason !== undefined) {
      void this.giveReason(reason);
      return;
    }
    const step = BOX_STEPS.get(commandId);
    if (step !== undefined) {
      this.step(step, fine ? 0.1 : 1);
      return;
    }
    switch (commandId) {
      case "missed.new":
        this.draw(this.newRect());
        break;
      case "missed.next":
        this.chooseBy(1);
        break;
      case "missed.previous":
        this.chooseBy(-1);
        break;
      case "missed.delete":
        void this.remove();
        break;
      case "missed.done":
        this.stage.machine.leave();
        break;
    }
  }

  private missed(): readonly MissedVessel[] {
    return this.scene === null ? [] : (this.stage.around.of(this.scene.image.id)?.missed ?? []);
  }

  private get imageSize(): Size {
    const image = this.scene?.image;
    return { width: image?.width_px ?? 1, height: image?.height_px ?? 1 };
  }

  private choose(vessel: MissedVessel | null): void {
    this.settleNow();
    this.chosen =
      vessel === null ? null : { stored: vessel, rect: rectOf(vessel), key: randomKey() };
    this.show();
  }

  /** A box without a reason yet. */
  private draw(rect: Rect): void {
    this.settleNow();
    this.chosen = { stored: null, rect, key: randomKey() };
    this.show();
    this.stage.announce("New box. Why has this vessel no box?");
  }

  private chooseBy(by: 1 | -1): void {
    const all = this.missed();
    const at = all.findIndex(({ id }) => id === this.chosen?.stored?.id);
    this.choose(all[(at + by + all.length) % Math.max(1, all.length)] ?? null);
  }

  private newRect(): Rect {
    const { viewer } = this.stage;
    const { clientWidth: width, clientHeight: height } = viewer.surface;
    const corner = (side: 1 | -1): Point =>
      toImage(viewer.currentView(), [
        (width / 2) * (1 + side * NEW_SHARE),
        (height / 2) * (1 + side * NEW_SHARE),
      ]);
    return rectBetween(corner(-1), corner(1), this.imageSize);
  }

  private step([dx, dy, wider, higher]: readonly [number, number, number, number], share: number): void {
    if (this.chosen === null) {
      return;
    }
    const by = (STEP_PX * share) / this.stage.viewer.currentView().scale;
    const moved = movedRect(this.chosen.rect, dx * by, dy * by, this.imageSize);
    this.chosen.rect = grownRect(moved, wider * by, higher * by, this.imageSize);
    this.show();
    this.storeSoon();
  }

  private drag(grip: Grip, to: Point): void {
    this.overlay.show(this.after(grip, to));
    this.stage.viewer.requestRender();
  }

  private endDrag(grip: Grip, to: Point): void {
    const rect = this.after(grip, to);
    if (grip.kind === "draw") {
      if (isLargeEnough(rect)) {
        this.draw(rect);
      } else {
        this.choose(this.missed().find((vessel) => contains(rectOf(vessel), to)) ?? null);
      }
    } else if (this.chosen !== null && isLargeEnough(rect)) {
      this.chosen.rect = rect;
      this.show();
      this.storeSoon();
    } else {
      this.show();
    }
  }

  private after(grip: Grip, to: Point): Rect {
    switch (grip.kind) {
      case "draw":
        return rectBetween(grip.from, to, this.imageSize);
      case "stretch":
        return rectBetween(grip.fixed, to, this.imageSize);
      case "move":
        return movedRect(grip.rect, to[0] - grip.from[0], to[1] - grip.from[1], this.imageSize);
    }
  }

  private show(): void {
    const { chosen } = this;
    this.overlay.show(chosen?.rect ?? null);
    this.panel.show(
      this.missed(),
      chosen?.stored?.id ?? null,
      chosen !== null && chosen.stored === null,
      chosen?.stored?.reason ?? null,
    );
    this.stage.viewer.requestRender();
  }

  private async giveReason(reason: MissedReason): Promise<void> {
    const { chosen, scene } = this;
    if (chosen === null || scene === null) {
      return;
    }
    if (chosen.stored !== null) {
      await this.change(chosen.stored, { reason });
      return;
    }
    try {
      this.replace(scene, await storeMissed(scene, chosen.rect, reason, chosen.key));
      if (this.chosen === chosen) {
        this.choose(null); // the next one may be drawn at once
      }
      this.stage.announce(`Stored: ${MISSED_WORDS[reason]}.`);
    } catch (error) {
      showFlash(`The box was not stored. ${explain(error)} Press the reason again.`, "error");
    }
  }

  private async change(
    stored: MissedVessel,
    changed: Parameters<typeof changeMissed>[1],
  ): Promise<void> {
    const { scene } = this;
    if (scene === null) {
      return;
    }
    try {
      const next = await changeMissed(stored, changed);
      this.replace(scene, next);
      if (this.chosen?.stored?.id === next.id) {
        this.chosen = { ...this.chosen, stored: next }; // it may have been moved on meanwhile
        this.show();
      }
    } catch (error) {
      await this.afterRefusal(scene, error, "The change was not stored.");
    }
  }

  private async remove(): Promise<void> {
    const { chosen, scene } = this;
    if (chosen === null || scene === null) {
      return;
    }
    if (chosen.stored === null) {
      this.choose(null);
      return;
    }
    const { stored } = chosen;
    this.forgetSettling();
    try {
      await deleteMissed(stored);
      const left = this.missed().filter(({ id }) => id !== stored.id);
      this.stage.around.change(scene.image.id, { missed: left });
      this.stage.surroundingsChanged();
      this.choose(null);
      this.stage.announce("Deleted.");
    } catch (error) {
      await this.afterRefusal(scene, error, "It was not deleted.");
    }
  }

  private async afterRefusal(scene: Scene, error: unknown, what: string): Promise<void> {
    const isStale = error instanceof ApiProblem && (error.status === 412 || error.status === 404);
    if (!isStale) {
      showFlash(`${what} ${explain(error)}`, "error");
      return;
    }
    showFlash(`${what} Somebody else changed it meanwhile; theirs is shown now.`, "warning");
    await this.stage.around.load(scene.image.id).catch(() => undefined);
    this.stage.surroundingsChanged();
    this.choose(null);
  }

  private replace(scene: Scene, stored: MissedVessel): void {
    const known = this.stage.around.of(scene.image.id)?.missed ?? [];
    const others = known.filter(({ id }) => id !== stored.id);
    const missed = [...others, stored].sort((a, b) => a.id - b.id);
    this.stage.around.change(scene.image.id, { missed });
    this.stage.surroundingsChanged();
  }

  private storeSoon(): void {
    this.forgetSettling();
    if (this.chosen !== null && this.chosen.stored !== null) {
      this.settling = setTimeout(() => {
        this.settleNow();
      }, SETTLE_MS);
    }
  }

  private settleNow(): void {
    if (this.settling !== null && this.chosen !== null && this.chosen.stored !== null) {
      this.forgetSettling();
      void this.change(this.chosen.stored, pixelsOf(this.chosen.rect));
    }
  }

  private forgetSettling(): void {
    if (this.settling !== null) {
      clearTimeout(this.settling);
      this.settling = null;
    }
  }
}
