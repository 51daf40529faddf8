import { createServer, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { afterEach, describe, expect, it } from "vitest";
import { ApiProblem, call, explain, problemFrom, Unreachable } from "./api";

let server: Server | undefined;

afterEach(() => {
  server?.close();
});

async function serve(answer: (response: ServerResponse) => void): Promise<string> {
  server = createServer((_, response) => {
    answer(response);
  });
  await new Promise<void>((resolve) => server?.listen(0, "127.0.0.1", resolve));
  return `http://127.0.0.1:${(server.address() as AddressInfo).port}/`;
}

async function failureOf(promise: Promise<unknown>): Promise<unknown> {
  return promise.then(
    () => null,
    (error: unknown) => error,
  );
}

describe("calling the REST interface", () => {
  it("returns JSON, and null for an answer without a body", async () => {
    const url = await serve((response) => response.end('{"items": [1]}'));
    expect(await call(url)).toEqual({ items: [1] });
    server?.close();
    const empty = await serve((response) => response.writeHead(204).end());
    expect(await call(empty)).toBeNull();
  });

  it("throws the server's problem with its fields", async () => {
    const url = await serve((response) => {
      response.writeHead(422, { "Content-Type": "application/problem+json" });
      const errors = [{ field: "camera_id", message: "No such camera." }, "nonsense"];
      response.end(JSON.stringify({ title: "Invalid input", detail: "See the fields.", errors }));
    });
    const problem = await failureOf(call(url, { method: "POST", json: {} }));
    expect(problem).toBeInstanceOf(ApiProblem);
    expect(problem).toMatchObject({
      status: 422,
      title: "Invalid input",
      detail: "See the fields.",
      fields: [{ field: "camera_id", message: "No such camera." }],
    });
    expect(explain(problem)).toBe("See the fields.");
  });

  it("makes do with the status where a proxy answers in HTML", async () => {
    const url = await serve((response) => response.writeHead(502, "Bad Gateway").end("<h1>Oops"));
    expect(explain(await failureOf(call(url)))).toBe("Bad Gateway");
  });

  it("tells a dead connection from an answer", async () => {
    const url = await serve((response) => response.socket?.destroy());
    expect(await failureOf(call(url))).toBeInstanceOf(Unreachable);
  });

  it("reads problems of any shape", () => {
    expect(problemFrom(500, null, "Error 500").message).toBe("Error 500");
    expect(problemFrom(400, { title: 7, errors: "x" }, "Error 400")).toMatchObject({
      title: "Error 400",
      fields: [],
    });
  });
});
