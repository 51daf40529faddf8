/**
 * A batch on the server: begun, its files announced, their bytes sent until all have come.
 *
 * A lost connection is waited out: the same request goes again, and the server takes nothing twice.
 * Only an answer that says no (an archive it refuses, a batch that is closed) ends a file or all.
 */
import { ApiProblem, Unreachable, call, problemFrom } from "../api";
import type { components } from "../api-types";
import { eachAtMost } from "../upload/queue";
import type { Chosen } from "./gather";
import { PACK_BYTES, isInPieces, packed } from "./packs";

type ServerFile = components["schemas"]["FileOut"];

const ANNOUNCED_AT_ONCE = 1000;
const AT_ONCE = 3;
const LONGEST_PAUSE_MS = 15_000;
const HASHED_UP_TO = 64 * 2 ** 20;
const PASSING: ReadonlySet<number> = new Set([408, 425, 429, 500, 502, 503, 504, 507]);

interface Item {
  readonly id: number;
  readonly size: number;
  readonly isArchive: boolean;
  readonly chosen: Chosen;
  received: number;
}

export interface Watcher {
  /** So many bytes of so many have come. */
  readonly onProgress: (sentBytes: number, allBytes: number) => void;
  readonly onRefused: (path: string, reason: string) => void;
  /** What keeps it waiting; empty when it goes on. */
  readonly onPause: (reason: string) => void;
}

export async function begin(cameraId: number, name: string): Promise<number> {
  const made = (await call("/api/v1/imports", {
    method: "POST",
    json: { camera_id: cameraId, name },
  })) as components["schemas"]["ImportOut"];
  return made.id;
}

export class Batch {
  private sent = 0;
  private all = 0;

  constructor(
    private readonly id: number,
    private readonly watcher: Watcher,
    private readonly isHashing: boolean,
  ) {}

  /** Sends what the server lacks of these files. */
  async send(chosen: readonly Chosen[]): Promise<void> {
    const items: Item[] = [];
    for (let begun = 0; begun < chosen.length; begun += ANNOUNCED_AT_ONCE) {
      items.push(...(await this.announce(chosen.slice(begun, begun + ANNOUNCED_AT_ONCE))));
    }
    this.all = items.reduce((sum, item) => sum + item.size, 0);
    this.sent = items.reduce((sum, item) => sum + item.received, 0);
    this.tell();
    await eachAtMost(packed(items), AT_ONCE, (pack) =>
      isInPieces(pack) ? this.sendInPieces(pack) : this.sendPack(pack),
    );
  }

  private async announce(part: readonly Chosen[]): Promise<Item[]> {
    const files: components["schemas"]["FileIn"][] = [];
    for (const { path, file } of part) {
      const told = {
        path,
        size_bytes: file.size,
        modified_at: new Date(file.lastModified).toISOString(),
      };
      const sha256 = this.isHashing ? await hashOf(file) : null;
      files.push(sha256 === null ? told : { ...told, sha256 });
    }
    const answer = (await this.persist(() =>
      call(`/api/v1/imports/${this.id}/files`, { method: "POST", json: { files } }),
    )) as components["schemas"]["ManifestOut"];
    return answer.files.flatMap((file, index) => {
      const found = part[index];
      if (found === undefined || file.state !== "waiting") {
        return [];
      }
      const isArchive = found.path.toLowerCase().endsWith(".zip");
      const received = file.received_bytes;
      return [{ id: file.id, size: file.size_bytes, isArchive, chosen: found, received }];
    });
  }

  private async sendPack(pack: readonly Item[]): Promise<void> {
    const ids = pack.map(({ id }) => id).join(",");
    const body = new Blob(pack.map(({ chosen }) => chosen.file));
    await this.persist(() => put(`/api/v1/imports/${this.id}/pack?files=${ids}`, "POST", body));
    this.sent += body.size;
    this.tell();
  }

  private async sendInPieces([item]: readonly Item[]): Promise<void> {
    while (item !== undefined && item.received < item.size) {
      const from = item.received;
      const piece = item.chosen.file.slice(from, from + PACK_BYTES);
      const url = `/api/v1/imports/${this.id}/files/${item.id}?offset=${from}`;
      try {
        const file = (await this.persist(() => put(url, "PUT", piece))) as ServerFile;
        // What is no longer waited for has been taken, whatever became of it.
        item.received = file.state === "waiting" ? file.received_bytes : item.size;
      } catch (error) {
        const received = error instanceof Behind ? error.received : null;
        if (received === null) {
          if (error instanceof ApiProblem && (error.status === 413 || error.status === 422)) {
            this.watcher.onRefused(item.chosen.path, error.message);
            item.received = item.size;
          } else {
            throw error;
          }
        } else {
          item.received = received;
        }
      }
      this.sent += item.received - from;
      this.tell();
    }
  }

  /** Tries again while the server is away or says that it is busy. */
  private async persist<Result>(send: () => Promise<Result>): Promise<Result> {
    for (let pause = 500; ; pause = Math.min(2 * pause, LONGEST_PAUSE_MS)) {
      try {
        const result = await send();
        this.watcher.onPause("");
        return result;
      } catch (error) {
        const isPassing = error instanceof ApiProblem && PASSING.has(error.status);
        if (!(error instanceof Unreachable) && !isPassing) {
          throw error;
        }
        this.watcher.onPause(error.message);
        await new Promise((resolve) => setTimeout(resolve, pause));
      }
    }
  }

  private tell(): void {
    this.watcher.onProgress(this.sent, this.all);
  }
}

/** The server has another number of bytes of a file than was thought. */
class Behind extends Error {
  constructor(readonly received: number) {
    super("go on from another place");
  }
}

async function put(url: string, method: string, body: Blob): Promise<unknown> {
  let response: Response;
  try {
    response = await fetch(url, {
      method,
      body,
      headers: { Accept: "application/json", "Content-Type": "application/octet-stream" },
      credentials: "same-origin",
    });
  } catch (error) {
    throw new Unreachable("The connection is lost.", { cause: error });
  }
  const answer: unknown = await response.json().catch(() => null);
  if (response.ok) {
    return answer;
  }
  if (response.status === 409 && isRecord(answer) && typeof answer["received_bytes"] === "number") {
    throw new Behind(answer["received_bytes"]);
  }
  throw problemFrom(response.status, answer, response.statusText);
}

/** The SHA-256 of a photograph; null where the browser may not compute it (no TLS), or it is large. */
async function hashOf(file: File): Promise<string | null> {
  const subtle = (crypto as { subtle?: SubtleCrypto }).subtle;
  if (subtle === undefined || file.size > HASHED_UP_TO) {
    return null;
  }
  const digest = await subtle.digest("SHA-256", await file.arrayBuffer());
  return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null;
}
