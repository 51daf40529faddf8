/** The run page's island: keeps every [data-run] up to date and lets its cancel button work. */
import { call, explain } from "./api";
import { showFlash } from "./page/flashes";
import { randomKey } from "./random-key";
import { counted, hasEnded, pace, type RunProgress } from "./run/progress";
import { RunWatch } from "./run/watch";

for (const element of document.querySelectorAll<HTMLElement>("[data-run]")) {
  follow(element);
}

function follow(element: HTMLElement): void {
  const url = `/api/v1/runs/${element.dataset["run"] ?? ""}`;
  const cancel = element.querySelector<HTMLButtonElement>("[data-run-cancel]");
  cancel?.addEventListener("click", () => {
    void cancelRun(url, cancel);
  });
  if (!hasEnded(element.dataset["status"] ?? "")) {
    const watch = new RunWatch(
      url,
      (progress) => {
        show(element, progress);
      },
      () => {
        location.reload(); // the server renders what the run has made
      },
    );
    watch.start();
  }
}

function show(element: HTMLElement, progress: RunProgress): void {
  const bar = element.querySelector("progress");
  if (bar !== null) {
    bar.max = Math.max(1, progress.images_total);
    bar.value = progress.images_done;
  }
  write(element, "[data-progress=left]", counted(progress));
  write(element, "[data-progress=right]", pace(progress));
  if (element.dataset["status"] !== progress.status) {
    element.dataset["status"] = progress.status;
    const badge = element.querySelector<HTMLTemplateElement>(
      `template[data-badge="${CSS.escape(progress.status)}"]`,
    );
    if (badge !== null) {
      element.querySelector("[data-run-status]")?.replaceChildren(badge.content.cloneNode(true));
    }
  }
}

function write(element: HTMLElement, selector: string, text: string): void {
  const target = element.querySelector(selector);
  if (target !== null) {
    target.textContent = text;
  }
}

async function cancelRun(url: string, button: HTMLButtonElement): Promise<void> {
  button.disabled = true;
  try {
    await call(`${url}/cancel`, { method: "POST", idempotencyKey: randomKey() });
  } catch (error) {
    button.disabled = false;
    showFlash(`The run was not cancelled. ${explain(error)}`, "error");
  }
}
