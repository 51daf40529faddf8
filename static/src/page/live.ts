/**
 * Keeps the live parts of a page up to date by fetching the page itself again.
 *
 * The server renders what is shown in one place only; the answer's parts with the same ids take the
 * place of those here, if they changed. It waits twenty times as long as the answer took, so that a
 * page left open costs the server a twentieth of a core at most, and not at all while nobody sees it.
 */

const COST_SHARE = 20;
const SETTLE_MS = 350;

export function delayMs(wantedSeconds: number, tookMs: number): number {
  return Math.max(wantedSeconds * 1000, tookMs * COST_SHARE);
}

/** The address a GET form leads to, without the fields that were left empty. */
export function addressOf(action: string, fields: Iterable<[string, string]>): string {
  const query = new URLSearchParams();
  for (const [name, value] of fields) {
    if (value !== "") {
      query.append(name, value);
    }
  }
  const text = query.toString();
  return text === "" ? action : `${action}?${text}`;
}

export class LivePage {
  private timer: number | undefined;
  private asked = 0;

  constructor(private readonly page: Document) {}

  start(): void {
    for (const form of this.page.querySelectorAll<HTMLFormElement>("[data-live-form]")) {
      this.submitWhenChanged(form);
    }
    this.page.addEventListener("visibilitychange", () => {
      if (!this.page.hidden) {
        this.refreshIn(0);
      }
    });
    this.refreshIn(this.wantedSeconds() * 1000);
  }

  private wantedSeconds(): number {
    const parts = [...this.page.querySelectorAll<HTMLElement>("[data-live]")];
    return Math.min(60, ...parts.map((part) => Number(part.dataset["live"])));
  }

  private refreshIn(ms: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.refresh(), ms);
  }

  private async refresh(): Promise<void> {
    if (this.page.hidden) {
      return; // it goes on when somebody looks again
    }
    const began = performance.now();
    const turn = ++this.asked;
    try {
      const response = await fetch(location.href, { headers: { Accept: "text/html" } });
      if (response.ok && !response.redirected && turn === this.asked) {
        this.take(new DOMParser().parseFromString(await response.text(), "text/html"));
      }
    } catch {
      // The page keeps showing what it last knew; the next turn tells.
    }
    this.refreshIn(delayMs(this.wantedSeconds(), performance.now() - began));
  }

  private take(fresh: Document): void {
    for (const part of this.page.querySelectorAll<HTMLElement>("[data-live]")) {
      const next = fresh.getElementById(part.id);
      if (next !== null && next.innerHTML !== part.innerHTML) {
        part.replaceChildren(...next.childNodes);
      }
    }
  }

  /** A choice from a list asks at once; a number that is being typed shows without leaving it. */
  private submitWhenChanged(form: HTMLFormElement): void {
    let settling: number | undefined;
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      location.assign(this.addressOf(form));
    });
    form.addEventListener("change", (event) => {
      if (event.target instanceof HTMLSelectElement) {
        location.assign(this.addressOf(form));
      }
    });
    form.addEventListener("input", (event) => {
      const field = event.target;
      if (field instanceof HTMLInputElement && field.type === "number" && field.checkValidity()) {
        window.clearTimeout(settling);
        settling = window.setTimeout(() => {
          history.replaceState(null, "", this.addressOf(form));
          this.refreshIn(0);
        }, SETTLE_MS);
      }
    });
  }

  private addressOf(form: HTMLFormElement): string {
    const fields = [...new FormData(form)].map(
      ([name, value]): [string, string] => [name, typeof value === "string" ? value : ""],
    );
    return addressOf(location.pathname, fields);
  }
}
