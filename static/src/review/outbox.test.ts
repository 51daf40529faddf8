import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { call, type ApiProblem } from "../api";
import { Outbox, type OutboxState, type PendingReview } from "./outbox";

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

describe("the outbox of grades", () => {
  let server: Server;
  let base: string;
  let received: Received[];
  /** Statuses to answer with, one a request; 201 once they are used up. 0 cuts the connection. */
  let answers: number[];

  beforeEach(async () => {
    received = [];
    answers = [];
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
        response.end(JSON.stringify({ title: "Told so", detail: `Answered ${status}.` }));
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
    readonly refused: [PendingReview, ApiProblem][];
    /** Resolves when the outbox has nothing left to send. */
    readonly idle: Promise<void>;
  }

  function open(store: MemoryStorage, user = "ada@example.org"): Opened {
    const states: OutboxState[] = [];
    const refused: [PendingReview, ApiProblem][] = [];
    let settle: () => void = () => undefined;
    const idle = new Promise<void>((resolve) => {
      settle = resolve;
    });
    const send = async (review: PendingReview): Promise<void> => {
      await call(`${base}/poses/${review.poseId}/reviews`, {
        method: "POST",
        json: { grade: review.grade, seconds: review.seconds },
        idempotencyKey: review.key,
      });
    };
    const outbox = new Outbox(store, user, 1, send, {
      onChange: (state) => {
        states.push(state);
        if (state === "idle") {
          settle();
        }
      },
      onRefused: (review, problem) => refused.push([review, problem]),
    });
    return { outbox, states, refused, idle };
  }

  it("sends grades in the order given and forgets them once acknowledged", async () => {
    const store = new MemoryStorage();
    const { outbox, idle } = open(store);
    outbox.add(1, "good", 0.8);
    outbox.add(2, "bad", 1.1);
    outbox.add(1, "ok", 0.5);
    expect(store.length).toBe(3);
    await idle;
    expect(received.map(({ path, grade }) => `${path} ${grade}`)).toEqual([
      "/poses/1/reviews good",
      "/poses/2/reviews bad",
      "/poses/1/reviews ok",
    ]);
    expect(new Set(received.map(({ key }) => key)).size).toBe(3);
    expect([store.length, outbox.pending.length]).toEqual([0, 0]);
  });

  it("tries again under the same key after a dead connection and after an error of the server", async () => {
    answers = [0, 503];
    const { outbox, states, idle } = open(new MemoryStorage());
    outbox.add(7, "good", 1);
    await idle;
    expect(received).toHaveLength(3);
    expect(new Set(received.map(({ key }) => key)).size).toBe(1);
    expect(states).toEqual(["sending", "offline", "offline", "idle"]);
  });

  it("keeps a grade for a page opened later when this one was closed before an answer", async () => {
    const store = new MemoryStorage();
    const send = (): Promise<void> => new Promise<void>(() => undefined); // never answered
    const closed = new Outbox(store, "ada@example.org", 1, send, {
      onChange: () => undefined,
      onRefused: () => undefined,
    });
    closed.add(3, "wrong", 2);
    const reopened = open(store);
    expect(reopened.outbox.pending.map(({ poseId, grade }) => [poseId, grade])).toEqual([
      [3, "wrong"],
    ]);
    reopened.outbox.flush();
    await reopened.idle;
    expect(received.map(({ path }) => path)).toEqual(["/poses/3/reviews"]);
    expect(store.length).toBe(0);
  });

  it("gives up on what the server refuses, says why, and goes on with the rest", async () => {
    answers = [422];
    const store = new MemoryStorage();
    const { outbox, refused, idle } = open(store);
    outbox.add(1, "good", 1);
    outbox.add(2, "good", 1);
    await idle;
    expect(refused.map(([review, problem]) => [review.poseId, problem.detail])).toEqual([
      [1, "Answered 422."],
    ]);
    expect(received).toHaveLength(2);
    expect(store.length).toBe(0);
  });

  it("waits, losing nothing, while nobody is signed in", async () => {
    answers = [401];
    const { outbox, states, refused, idle } = open(new MemoryStorage());
    outbox.add(1, "good", 1);
    await idle;
    expect(states).toContain("signed-out");
    expect(refused).toEqual([]);
    expect(received).toHaveLength(2);
  });

  it("leaves another person's grades alone", async () => {
    const store = new MemoryStorage();
    store.setItem(
      "quaymark.review.k",
      JSON.stringify({ key: "k", user: "bob@example.org", runId: 1, poseId: 9, grade: "bad" }),
    );
    const { outbox, idle } = open(store);
    outbox.flush();
    await idle;
    expect(received).toEqual([]);
    expect(store.length).toBe(1);
  });
});
