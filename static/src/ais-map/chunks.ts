/**
 * Which tracks are loaded: ten minutes at a time, around the moment, for what is in sight at the map's scale.
 *
 * Those of the moment itself come first, so that there is something to see at once. Moving
 * the map within its surroundings or zooming a little loads nothing.
 */
import { call } from "../api";
import type { StretchJson, TrackStore } from "./track-store";

export const CHUNK_S = 600;
const KEPT = 60;
const AT_ONCE = 2;

/** What is loaded of the world: west, south, east, north in degrees, and how exactly. */
export interface Scope {
  readonly box: readonly [number, number, number, number];
  readonly toleranceM: number;
}

/** The chunks that a moment with its window needs, that of the moment first. */
export function chunksFor(momentS: number, windowS: number, aheadS: number): number[] {
  const own = Math.floor(momentS / CHUNK_S);
  const first = Math.floor((momentS - windowS) / CHUNK_S);
  const last = Math.floor((momentS + aheadS) / CHUNK_S);
  const all = Array.from({ length: last - first + 1 }, (_, index) => first + index);
  return all.sort((a, b) => Math.abs(a - own) - Math.abs(b - own) || b - a);
}

export function covers(loaded: Scope, wanted: Scope): boolean {
  const [west, south, east, north] = loaded.box;
  const [w, s, e, n] = wanted.box;
  const isInside = w >= west && s >= south && e <= east && n <= north;
  return isInside && loaded.toleranceM <= 2 * wanted.toleranceM && loaded.toleranceM >= wanted.toleranceM / 16;
}

export class Chunks {
  private scope: Scope | null = null;
  private generation = 0;
  private wanted: number[] = [];
  private readonly loading = new Set<number>();

  constructor(
    private readonly siteId: number,
    private readonly store: TrackStore,
    private readonly onLoaded: () => void,
    private readonly onFailed: (error: unknown) => void,
  ) {}

  get isLoading(): boolean {
    return this.loading.size > 0;
  }

  /** Says what is in sight; what was loaded for another scale or place stays until it is replaced. */
  look(wanted: Scope): void {
    if (this.scope !== null && covers(this.scope, wanted)) {
      return;
    }
    const [west, south, east, north] = wanted.box;
    const [across, along] = [(east - west) / 2, (north - south) / 2];
    this.scope = {
      box: [
        Math.max(-180, west - across),
        Math.max(-90, south - along),
        Math.min(180, east + across),
        Math.min(90, north + along),
      ],
      toleranceM: wanted.toleranceM,
    };
    this.reload();
  }

  get loaded(): Scope | null {
    return this.scope;
  }

  /** Loads all anew: what was loaded may lack what came since. */
  reload(): void {
    this.generation += 1;
    this.loading.clear();
    this.store.clear();
    this.next();
  }

  /** Loads a chunk again, to take the place of what is there. */
  renew(chunk: number): void {
    if (this.scope !== null && this.store.has(chunk) && !this.loading.has(chunk)) {
      void this.load(chunk, this.scope, this.generation);
    }
  }

  need(momentS: number, windowS: number, aheadS: number): void {
    this.wanted = chunksFor(momentS, windowS, aheadS).slice(0, KEPT);
    this.next();
  }

  private next(): void {
    const { scope } = this;
    if (scope === null) {
      return;
    }
    for (const chunk of this.wanted) {
      if (this.loading.size >= AT_ONCE) {
        return;
      }
      if (!this.store.has(chunk) && !this.loading.has(chunk)) {
        void this.load(chunk, scope, this.generation);
      }
    }
  }

  private async load(chunk: number, scope: Scope, generation: number): Promise<void> {
    this.loading.add(chunk);
    const query = new URLSearchParams({
      from: new Date(chunk * CHUNK_S * 1000).toISOString(),
      to: new Date((chunk + 1) * CHUNK_S * 1000 - 1).toISOString(),
      bbox: scope.box.map((degrees) => degrees.toFixed(5)).join(","),
      tolerance_m: String(scope.toleranceM),
    });
    let found: unknown = null;
    let failure: unknown = null;
    try {
      found = await call(`/api/v1/sites/${this.siteId}/ais/tracks?${query.toString()}`);
    } catch (error) {
      failure = error;
    }
    if (generation !== this.generation) {
      return; // another place or scale is wanted by now
    }
    this.loading.delete(chunk);
    if (found === null) {
      this.onFailed(failure); // asked for again with the next moment
      return;
    }
    this.store.keep(new Set([...this.wanted, chunk]));
    this.store.add(chunk, found as StretchJson);
    this.next();
    this.onLoaded();
  }
}
