/**
 * The boxes of a photograph on their way to the server: shown at once, sent one after the other, in
 * the order they were made, so that a change never overtakes the box it changes.
 */
import { call } from "../api";
import { randomKey } from "../random-key";
import type { Rect } from "../viewer/view";
import { placeOf, type Box, type BoxOut, type Scene, type VesselClass } from "./scene";

const ROOT = "/api/v1/ground-truth";

export interface Look {
  readonly rect: Rect;
  readonly vesselClass: VesselClass;
}

export class BoxStore {
  private last: Promise<void> = Promise.resolve();
  private waiting = 0;

  constructor(
    private readonly onChange: (waiting: number) => void,
    private readonly onFailure: (error: unknown) => void,
  ) {}

  /** The scene of a photograph, once all that is on its way has arrived. */
  async scene(imageId: number): Promise<Scene> {
    await this.last;
    return (await call(`${ROOT}/photographs/${imageId}`)) as Scene;
  }

  get isIdle(): boolean {
    return this.waiting === 0;
  }

  create(imageId: number, box: Box): void {
    const key = randomKey();
    this.send(async () => {
      const stored = (await call(`${ROOT}/boxes`, {
        method: "POST",
        json: { image_id: imageId, vessel_class: box.vesselClass, ...placeOf(box.rect) },
        idempotencyKey: key,
      })) as BoxOut;
      box.id = stored.id;
      box.version = stored.version;
    });
  }

  change(box: Box, { rect, vesselClass }: Look): void {
    this.send(async () => {
      if (box.id === null) {
        return;
      }
      const stored = (await call(`${ROOT}/boxes/${box.id}`, {
        method: "PATCH",
        json: { vessel_class: vesselClass, ...placeOf(rect) },
        ifMatch: box.version,
      })) as BoxOut;
      box.version = stored.version;
    });
  }

  remove(box: Box): void {
    this.send(async () => {
      if (box.id !== null) {
        await call(`${ROOT}/boxes/${box.id}`, { method: "DELETE", ifMatch: box.version });
      }
    });
  }

  restore(box: Box): void {
    this.send(async () => {
      if (box.id !== null) {
        const stored = (await call(`${ROOT}/boxes/${box.id}/restore`, { method: "POST" })) as BoxOut;
        box.version = stored.version;
      }
    });
  }

  setComplete(imageId: number, isComplete: boolean): void {
    this.send(async () => {
      const image = (await call(`${ROOT}/images`, {
        method: "POST",
        json: { image_id: imageId, is_complete: isComplete },
      })) as { readonly id: number; readonly version: number };
      if (!isComplete) {
        await call(`${ROOT}/images/${image.id}`, {
          method: "PATCH",
          json: { is_complete: false },
          ifMatch: image.version,
        });
      }
    });
  }

  private send(act: () => Promise<void>): void {
    this.waiting += 1;
    this.onChange(this.waiting);
    this.last = this.last
      .then(act)
      .catch((error: unknown) => {
        this.onFailure(error);
      })
      .finally(() => {
        this.waiting -= 1;
        this.onChange(this.waiting);
      });
  }
}
