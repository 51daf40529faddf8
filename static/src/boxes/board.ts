/**
 * What is on the photograph and which box is chosen, with everything that can be undone. Pure: the
 * store is told what to send by the acts that the board gives back.
 */
import type { Box, VesselClass } from "./scene";
import type { Rect } from "../viewer/view";

type Undo =
  | { readonly kind: "created"; readonly box: Box }
  | { readonly kind: "deleted"; readonly box: Box }
  | { readonly kind: "changed"; readonly box: Box; readonly rect: Rect; readonly vesselClass: VesselClass };

export type Act =
  | { readonly kind: "create" | "remove" | "restore" | "change"; readonly box: Box };

const MOST_UNDOS = 200;

export class Board {
  private all: Box[] = [];
  private readonly undos: Undo[] = [];
  chosen: Box | null = null;

  /** A box that was drawn, but has no class yet. */
  pending: Rect | null = null;

  reset(boxes: readonly Box[]): void {
    this.all = [...boxes];
    this.undos.length = 0;
    this.chosen = null;
    this.pending = null;
  }

  get boxes(): readonly Box[] {
    return this.all.filter(({ isGone }) => !isGone);
  }

  add(rect: Rect, vesselClass: VesselClass): Act {
    const box: Box = { id: null, version: 0, rect, vesselClass, isGone: false };
    this.all.push(box);
    this.pending = null;
    this.chosen = box;
    this.remember({ kind: "created", box });
    return { kind: "create", box };
  }

  change(box: Box, rect: Rect, vesselClass: VesselClass): Act {
    this.remember({ kind: "changed", box, rect: box.rect, vesselClass: box.vesselClass });
    box.rect = rect;
    box.vesselClass = vesselClass;
    return { kind: "change", box };
  }

  remove(box: Box): Act {
    box.isGone = true;
    this.chosen = null;
    this.remember({ kind: "deleted", box });
    return { kind: "remove", box };
  }

  /** Takes the last act back; null when there is none. */
  undo(): Act | null {
    const last = this.undos.pop();
    if (last === undefined) {
      return null;
    }
    const { box } = last;
    box.isGone = last.kind === "created";
    this.chosen = box.isGone ? null : box;
    if (last.kind === "changed") {
      box.rect = last.rect;
      box.vesselClass = last.vesselClass;
      return { kind: "change", box };
    }
    return { kind: last.kind === "created" ? "remove" : "restore", box };
  }

  chooseBy(by: 1 | -1): void {
    const { boxes } = this;
    const at = this.chosen === null ? (by === 1 ? -1 : 0) : boxes.indexOf(this.chosen);
    this.chosen = boxes[(at + by + boxes.length) % Math.max(1, boxes.length)] ?? null;
  }

  private remember(undo: Undo): void {
    this.undos.push(undo);
    if (this.undos.length > MOST_UNDOS) {
      this.undos.shift();
    }
  }
}
