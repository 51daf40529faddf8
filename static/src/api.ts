/**
 * Talking to the REST interface: JSON in and out, and errors that say what a person can do.
 *
 * Errors come in two kinds. An ApiProblem is the server's answer (problem+json, RFC 9457); an
 * Unreachable means that no answer came, so that trying again later may help.
 */

export interface FieldProblem {
  readonly field: string;
  readonly message: string;
}

export class ApiProblem extends Error {
  override readonly name = "ApiProblem";

  constructor(
    readonly status: number,
    readonly title: string,
    readonly detail: string,
    readonly fields: readonly FieldProblem[] = [],
  ) {
    super(detail === "" ? title : detail);
  }
}

export class Unreachable extends Error {
  override readonly name = "Unreachable";
}

export interface CallOptions {
  readonly method?: "GET" | "POST" | "PUT" | "PATCH" | "DELETE";
  readonly json?: unknown;
  readonly form?: FormData;
  readonly idempotencyKey?: string;
  /** The version that an edit began from; another one on the server refuses it with 412. */
  readonly ifMatch?: number;
  /** The call outlives the page, within the browser's limits. */
  readonly keepalive?: boolean;
  readonly signal?: AbortSignal;
}

/** Calls and returns the parsed body, null when there is none. Throws ApiProblem or Unreachable. */
export async function call(url: string, options: CallOptions = {}): Promise<unknown> {
  return (await callVersioned(url, options)).body;
}

/** As `call`, with the version of what was read or written (its ETag), null when it has none. */
export async function callVersioned(
  url: string,
  options: CallOptions = {},
): Promise<{ readonly body: unknown; readonly version: number | null }> {
  const headers = new Headers({ Accept: "application/json" });
  if (options.json !== undefined) {
    headers.set("Content-Type", "application/json");
  }
  if (options.idempotencyKey !== undefined) {
    headers.set("Idempotency-Key", options.idempotencyKey);
  }
  if (options.ifMatch !== undefined) {
    headers.set("If-Match", `"${options.ifMatch}"`);
  }
  const body = options.json === undefined ? (options.form ?? null) : JSON.stringify(options.json);
  let response: Response;
  try {
    response = await fetch(url, {
      method: options.method ?? "GET",
      headers,
      body,
      credentials: "same-origin",
      keepalive: options.keepalive ?? false,
      signal: options.signal ?? null,
    });
  } catch (error) {
    if (options.signal?.aborted === true) {
      throw error;
    }
    throw new Unreachable("The server cannot be reached. Check the connection.", { cause: error });
  }
  if (!response.ok) {
    throw await readProblem(response);
  }
  const version = Number(response.headers.get("ETag")?.replaceAll(/["W/]/g, "") ?? Number.NaN);
  return { body: await readBody(response), version: Number.isInteger(version) ? version : null };
}

async function readBody(response: Response): Promise<unknown> {
  const text = await response.text();
  return text === "" ? null : (JSON.parse(text) as unknown);
}

async function readProblem(response: Response): Promise<ApiProblem> {
  const fallback = response.statusText === "" ? `Error ${response.status}` : response.statusText;
  let body: unknown = null;
  try {
    body = await readBody(response);
  } catch {
    // A proxy's HTML page, say: the status alone has to do.
  }
  return problemFrom(response.status, body, fallback);
}

/** Reads a problem+json body; whatever is missing or malformed is left out. */
export function problemFrom(status: number, body: unknown, fallback: string): ApiProblem {
  const text = (value: unknown, otherwise: string): string =>
    typeof value === "string" ? value : otherwise;
  if (!isRecord(body)) {
    return new ApiProblem(status, fallback, "");
  }
  const errors = Array.isArray(body["errors"]) ? (body["errors"] as unknown[]) : [];
  const fields = errors
    .filter(isRecord)
    .map((error) => ({ field: text(error["field"], ""), message: text(error["message"], "") }));
  return new ApiProblem(status, text(body["title"], fallback), text(body["detail"], ""), fields);
}

/** The sentence to show for anything thrown by a call. */
export function explain(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
