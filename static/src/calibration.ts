/** The calibration page's island: shows how far the search for corners is, then reloads. */
import { call } from "./api";
import { number } from "./format";

const POLL_MS = 1000;

interface Calibration {
  readonly status: string;
  readonly photos: readonly { readonly corners_px: unknown; readonly problem: string | null }[];
}

for (const element of document.querySelectorAll<HTMLElement>("[data-calibration]")) {
  void follow(element);
}

async function follow(element: HTMLElement): Promise<void> {
  const url = `/api/v1/calibrations/${element.dataset["calibration"] ?? ""}`;
  for (;;) {
    try {
      const found = (await call(url)) as Calibration;
      if (found.status !== "queued" && found.status !== "running") {
        location.reload(); // the server renders the lens
        return;
      }
      report(element, found);
    } catch {
      // The next poll tells; the page keeps showing what it last knew.
    }
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

function report(element: HTMLElement, found: Calibration): void {
  const total = found.photos.length;
  const done = found.photos.filter((photo) => photo.corners_px !== null || photo.problem !== null);
  const bar = element.querySelector("progress");
  if (bar !== null) {
    bar.max = Math.max(1, total);
    bar.value = done.length;
  }
  const left = element.querySelector("[data-progress=left]");
  if (left !== null) {
    left.textContent = `${number(done.length)} of ${number(total)} photographs`;
  }
  const right = element.querySelector("[data-progress=right]");
  if (right !== null) {
    right.textContent = found.status === "queued" ? "Waiting for a worker" : "";
  }
}
