import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { call, type ApiProblem } from "../api";
import { Outbox, type OutboxState } from "./outbox";
import { WriteStore } from "./write-store";
import type { PendingWrite, Write } from "./writes";

/** The browser's storage, as the specification of Web Storage has it. */
class MemoryStorage {
  private readonly entries = new Map<string, string>();
  get length(): number {
    return this.entries.size;
  }
  key(index: number): string | null {
    return [...this.entries.keys()][index] ?? null;
  }
  getItem(name: string): string | null {
    return this.entries.get(name) ?? null;
  }
  setItem(name: string, value: string): void {
    this.entries.set(name, value);
  }
  removeItem(name: string): void {
    this.entries.delete(name);
  }
}

interface Received {
  readonly path: string;
  readonly key: string;
  readonly grade: string;
}

describe("the outbox", () => {
  let server: Server;
  let base: string;
  let received: Received[];
  /** Statuses to answer with, one a request; 201 once they are used up. 0 cuts the connection. */
  let answers: number[];
  /** Conflicts name a field, or none when the same write is under way. */
  let conflictField: string | null;

  beforeEach(async () => {
    received = [];
    answers = [];
    conflictField = null;
    server = createServer((request, response) => {
      let body = "";
      request.on("data", (part: Buffer) => {
        body += part.toString();
      });
      request.on("end", () => {
        const { grade } = JSON.parse(body) as { grade: string };
        const key = String(request.headers["idempotency-key"]);
        received.push({ path: request.url ?? "", key, grade });
        const status = answers.shift() ?? 201;
        if (status === 0) {
          request.socket.destroy();
          return;
        }
        response.writeHead(status, { "Content-Type": "application/problem+json" });
        const errors = conflictField === null ? [] : [{ field: conflictField, message: "no" }];
        response.end(JSON.stringify({ title: "Told so", detail: `Answered ${status}.`, errors }));
      });
    });
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    base = `http://127.0.0.1:${(server.address() as AddressInfo).port}`;
  });

  afterEach(() => {
    server.closeAllConnections();
    server.close();
  });

  interface Opened {
    readonly outbox: Outbox;
    readonly states: OutboxState[];
    readonly refused: [PendingWrite, ApiProblem][];
    readonly sent: PendingWrite[];
    /** Resolves when the outbox has nothing left to send. */
    readonly idle: Promise<void>;
  }

  function aGrade(poseId: number, grade: "good" | "ok" | "bad", imageId = poseId): Write {
    return {
      channel: `image:${imageId}`,
      method: "POST",
      url: `/poses/${poseId}/reviews`,
      json: { grade },
      label: "The grade",
      runId: 1,
      effect: { kind: "grade", imageId, poseIds: [poseId], grade },
    };
  }

  /** All tabs of a browser share the lock and the storage. */
  function aLock(): (task: () => Promise<void>) => Promise<void> {
    let last = Promise.resolve();
    return (task) => {
      last = last.then(task);
      return last;
    };
  }

  function open(store: MemoryStorage, user = "ada@example.org", lock = aLock()): Opened {
    const states: OutboxState[] = [];
    const refused: [PendingWrite, ApiProblem][] = [];
    const sent: PendingWrite[] = [];
    let settle: () => void = () => undefined;
    const idle = new Promise<void>((resolve) => {
      settle = resolve;
    });
    const send = async ({ url, json, key }: PendingWrite): Promise<unknown> =>
      call(base + url, { method: "POST", json, idempotencyKey: key });
    const events = {
      onChange: (state: OutboxState): void => {
        states.push(state);
        if (state === "idle") {
          settle();
        }
      },
      onSent: (write: PendingWrite): void => {
        sent.push(write);
      },
      onRefused: (write: PendingWrite, problem: ApiProblem): void => {
        refused.push([write, problem]);
      },
    };
    const outbox = new Outbox(new WriteStore(store, user), send, events, lock);
    return { outbox, states, refused, sent, idle };
  }

  it("sends acts in the order given and forgets them once acknowledged", async () => {
    const store = new MemoryStorage();
    const { outbox, idle, sent } = open(store);
    outbox.add(aGrade(1, "good"));
    outbox.add(aGrade(2, "bad"));
    outbox.add(aGrade(1, "ok"));
    expect(store.length).toBe(3);
    await idle;
    expect(received.map(({ path, grade }) => `${path} ${grade}`)).toEqual([
      "/poses/1/reviews good",
      "/poses/2/reviews bad",
      "/poses/1/reviews ok",
    ]);
    expect(new Set(received.map(({ key }) => key)).size).toBe(3);
    expect([store.length, outbox.pending.length, sent.length]).toEqual([0, 0, 3]);
  });

  it("tries again under the same key after a dead connection and after an error of the server", async () => {
    answers = [0, 503];
    const { outbox, states, idle } = open(new MemoryStorage());
    outbox.add(aGrade(7, "good"));
    await idle;
    expect(received).toHaveLength(3);
    expect(new Set(received.map(({ key }) => key)).size).toBe(1);
    expect(states.filter((state, i) => state !== states[i - 1])).toEqual([
      "sending",
      "offline",
      "idle",
    ]);
  });

  it("keeps an act for a page opened later when this one was closed before an answer", async () => {
    const store = new MemoryStorage();
    const never = (): Promise<void> => new Promise<void>(() => undefined);
    const closed = open(store, "ada@example.org", never); // its turn to send never came
    closed.outbox.add(aGrade(3, "bad"));
    const reopened = open(store);
    expect(reopened.outbox.pending.map(({ url }) => url)).toEqual(["/poses/3/reviews"]);
    reopened.outbox.flush();
    await reopened.idle;
    expect(received.map(({ path }) => path)).toEqual(["/poses/3/reviews"]);
    expect(store.length).toBe(0);
  });

  it("gives up on what the server refuses, says why, and goes on with the rest", async () => {
    answers = [422];
    const store = new MemoryStorage();
    const { outbox, refused, idle } = open(store);
    outbox.add(aGrade(1, "good"));
    outbox.add(aGrade(2, "good"));
    await idle;
    expect(refused.map(([{ url }, { detail }]) => [url, detail])).toEqual([
      ["/poses/1/reviews", "Answered 422."],
    ]);
    expect(received).toHaveLength(2);
    expect(store.length).toBe(0);
  });

  it("waits while the very same act is under way, and takes other conflicts as a refusal", async () => {
    answers = [409];
    const first = open(new MemoryStorage());
    first.outbox.add(aGrade(1, "good"));
    await first.idle;
    expect([first.refused.length, received.length]).toEqual([0, 2]);
    answers = [409];
    conflictField = "poses";
    const second = open(new MemoryStorage());
    second.outbox.add(aGrade(1, "good"));
    await second.idle;
    expect([second.refused.length, received.length]).toEqual([1, 3]);
  });

  it("lets others pass an act over which the server stumbles again and again", async () => {
    answers = [500, 500, 500]; // then it recovers
    const { outbox, idle } = open(new MemoryStorage());
    outbox.add(aGrade(1, "good"));
    outbox.add(aGrade(1, "bad"));
    outbox.add(aGrade(2, "ok"));
    await idle;
    expect(received.map(({ path, grade }) => `${path} ${grade}`)).toEqual([
      "/poses/1/reviews good",
      "/poses/1/reviews good",
      "/poses/1/reviews good",
      "/poses/2/reviews ok",
      "/poses/1/reviews good",
      "/poses/1/reviews bad",
    ]);
  }, 20_000);

  it("waits, losing nothing, while nobody is signed in", async () => {
    answers = [401];
    const { outbox, states, refused, idle } = open(new MemoryStorage());
    outbox.add(aGrade(1, "good"));
    await idle;
    expect(states).toContain("signed-out");
    expect(refused).toEqual([]);
    expect(received).toHaveLength(2);
  });

  it("leaves another person's acts alone", async () => {
    const store = new MemoryStorage();
    new WriteStore(store, "bob@example.org").add(aGrade(9, "bad"));
    const { outbox, idle } = open(store);
    outbox.flush();
    await idle;
    expect(received).toEqual([]);
    expect(store.length).toBe(1);
  });

  it("sends each act once though two tabs are open, whichever tab does it", async () => {
    const [store, lock] = [new MemoryStorage(), aLock()];
    const one = open(store, "ada@example.org", lock);
    const other = open(store, "ada@example.org", lock);
    for (const poseId of [1, 2, 3]) {
      one.outbox.add(aGrade(poseId, "good"));
    }
    other.outbox.reread();
    other.outbox.add(aGrade(4, "ok"));
    await Promise.all([one.idle, other.idle]);
    one.outbox.reread();
    other.outbox.reread();
    expect(received.map(({ path }) => path).sort()).toEqual(
      [1, 2, 3, 4].map((id) => `/poses/${id}/reviews`),
    );
    expect([one.outbox.pending, other.outbox.pending]).toEqual([[], []]);
  });

  it("drops what lies in the storage and cannot be read", () => {
    const store = new MemoryStorage();
    store.setItem("quaymark.write.broken", "{");
    expect(open(store).outbox.pending).toEqual([]);
  });
});
