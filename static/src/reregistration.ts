/**
 * The pages of re-registration: follows a job until it has ended, and lets a person flick between
 * before and after over a photograph. Keys go by their place and are muted while typing.
 */
import { call } from "./api";
import { duration, number } from "./format";
import { FlickOverlay, type DrawnPose } from "./reregistration/flick-overlay";
import { ReferenceLayer } from "./reregistration/reference-layer";
import { DragPan } from "./viewer/gestures/drag-pan";
import { PinchZoom } from "./viewer/gestures/pinch-zoom";
import { ViewKeys } from "./viewer/gestures/view-keys";
import { WheelZoom } from "./viewer/gestures/wheel-zoom";
import { Viewer } from "./viewer/viewer";

const POLL_MS = 1000;

interface Progress {
  readonly status: string;
  readonly images_done: number;
  readonly images_total: number;
  readonly images_passed: number;
  readonly images_refused: number;
  readonly images_per_s: number | null;
  readonly remaining_s: number | null;
}

interface Drawn {
  readonly width_px: number;
  readonly height_px: number;
  readonly before: DrawnPose;
  readonly after: DrawnPose;
}

type Look = "before" | "after";

const CONTROLS = "input, select, button, a, summary";

for (const element of document.querySelectorAll<HTMLElement>("[data-reregistration]")) {
  if (element.dataset["ended"] !== "true") {
    void follow(element);
  }
}

for (const element of document.querySelectorAll<HTMLElement>("[data-flick]")) {
  flick(element);
}

async function follow(element: HTMLElement): Promise<void> {
  const url = `/api/v1/reregistrations/${element.dataset["reregistration"] ?? ""}`;
  for (;;) {
    try {
      const progress = (await call(url)) as Progress;
      if (progress.status !== "queued" && progress.status !== "running") {
        location.reload(); // the server renders what it has found
        return;
      }
      report(element, progress);
    } catch {
      // The next poll tells; the page keeps showing what it last knew.
    }
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

function report(element: HTMLElement, progress: Progress): void {
  const bar = element.querySelector("progress");
  if (bar !== null) {
    bar.max = Math.max(1, progress.images_total);
    bar.value = progress.images_done;
  }
  const { images_done: done, images_total: total, images_passed: passed } = progress;
  write(
    element,
    "left",
    `${number(done)} of ${number(total)} images, ${number(passed)} passed, ` +
      `${number(progress.images_refused)} refused`,
  );
  write(element, "right", pace(progress));
}

function pace(progress: Progress): string {
  if (progress.status === "queued") {
    return "Waiting for a worker";
  }
  if (progress.images_per_s === null) {
    return "";
  }
  const rate = `${number(progress.images_per_s, 1)} images/s`;
  return progress.remaining_s === null ? rate : `${rate}, ${duration(progress.remaining_s)} left`;
}

function write(element: HTMLElement, part: string, text: string): void {
  const target = element.querySelector(`[data-progress=${part}]`);
  if (target !== null) {
    target.textContent = text;
  }
}

function flick(element: HTMLElement): void {
  const surface = element.querySelector<HTMLElement>("[data-flick-view]");
  const mix = element.querySelector<HTMLInputElement>("[data-flick-mix]");
  const difference = element.querySelector<HTMLInputElement>("[data-flick-difference]");
  if (surface === null || mix === null || difference === null) {
    return;
  }
  const drawn = JSON.parse(element.dataset["overlay"] ?? "{}") as Drawn;
  const size = { width: drawn.width_px, height: drawn.height_px };
  const viewer = new Viewer(surface);
  const marks = new FlickOverlay();
  const reference = new ReferenceLayer(surface, size, {
    before: element.dataset["before"] ?? "",
    after: element.dataset["after"] ?? "",
  });
  viewer.add(reference);
  viewer.add(marks);
  new WheelZoom(viewer);
  new PinchZoom(viewer);
  new DragPan(viewer, () => undefined);
  const keys = new ViewKeys(viewer);
  const image = element.dataset["image"] ?? "";
  viewer.show(
    {
      previewUrl: `${image}/preview?width=1280`,
      fullUrl: `${image}/file`,
      size,
      description: "The photograph to register",
    },
    null,
  );

  let chosen: Look = "after";
  const show = (look: Look): void => {
    element.dataset["shows"] = look;
    marks.show(drawn[look], look);
    reference.show(look);
    for (const button of element.querySelectorAll<HTMLElement>("[data-flick-show]")) {
      button.setAttribute("aria-pressed", String(button.dataset["flickShow"] === look));
    }
  };
  const choose = (look: Look): void => {
    chosen = look;
    show(look);
    const said = element.querySelector("[data-flick-said]");
    if (said !== null) {
      said.textContent = look === "after" ? "After the turn" : "Before the turn";
    }
  };
  const blend = (): void => {
    reference.setMix(Number(mix.value) / 100, difference.checked);
  };
  mix.addEventListener("input", blend);
  difference.addEventListener("change", () => {
    if (difference.checked && mix.value === "0") {
      mix.value = "100";
    }
    blend();
  });
  for (const button of element.querySelectorAll<HTMLElement>("[data-flick-show]")) {
    button.addEventListener("click", () => {
      choose(button.dataset["flickShow"] === "before" ? "before" : "after");
    });
  }
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || isTyping(event.target)) {
      return;
    }
    const onControl = event.target instanceof Element && event.target.closest(CONTROLS) !== null;
    if (event.code === "KeyB" && !event.repeat) {
      choose(chosen === "after" ? "before" : "after");
    } else if (onControl) {
      return; // Space presses a button, arrows move a slider
    } else if (event.code === "Space") {
      show("before");
    } else if (!keys.handle(event)) {
      return;
    }
    event.preventDefault();
  });
  document.addEventListener("keyup", (event) => {
    if (event.code === "Space") {
      show(chosen);
    }
  });
  choose("after");
  blend();
}

function isTyping(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLTextAreaElement ||
    (target instanceof HTMLInputElement && target.type !== "range" && target.type !== "checkbox")
  );
}
