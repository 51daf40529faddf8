/** What goes into one request: many small files together, a large one by itself in pieces. */

export const PACK_BYTES = 8 * 2 ** 20;
export const MOST_IN_A_PACK = 200;

export interface Sendable {
  readonly id: number;
  readonly size: number;
  readonly isArchive: boolean;
}

/** Files in the order they came, in packs; what is larger than a pack, and archives, alone. */
export function packed<Item extends Sendable>(items: readonly Item[]): Item[][] {
  const packs: Item[][] = [];
  let open: Item[] = [];
  let held = 0;
  for (const item of items) {
    if (item.isArchive || item.size > PACK_BYTES) {
      packs.push([item]);
      continue;
    }
    if (open.length >= MOST_IN_A_PACK || held + item.size > PACK_BYTES) {
      packs.push(open);
      [open, held] = [[], 0];
    }
    open.push(item);
    held += item.size;
  }
  if (open.length > 0) {
    packs.push(open);
  }
  return packs;
}

/** Whether a pack has to be sent in pieces, each continuing what has come. */
export function isInPieces(pack: readonly Sendable[]): boolean {
  const [first] = pack;
  return first !== undefined && pack.length === 1 && (first.isArchive || first.size > PACK_BYTES);
}
