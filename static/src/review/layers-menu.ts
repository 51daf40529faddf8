/** Which layers are drawn: tick boxes in a small panel, remembered in this browser. */
import { LAYERS, type Layer } from "../viewer/overlay/pose-overlay";

const KEY = "quaymark.layers";
const SHOWN_AT_FIRST: readonly Layer[] = ["detection", "corrected", "box"];

export class LayersMenu {
  private readonly boxes: readonly HTMLInputElement[];
  private openedFrom: HTMLElement | null = null;

  constructor(
    private readonly panel: HTMLElement,
    private readonly opener: HTMLElement,
    private readonly onLayer: (layer: Layer, shown: boolean) => void,
  ) {
    this.boxes = [...panel.querySelectorAll<HTMLInputElement>("input[data-layer]")];
    const shown = read();
    for (const box of this.boxes) {
      const layer = layerOf(box);
      box.checked = shown.includes(layer);
      onLayer(layer, box.checked);
      box.addEventListener("change", () => {
        this.onLayer(layer, box.checked);
        this.write();
      });
    }
    panel.addEventListener("keydown", (event) => {
      if (event.key === "Escape") {
        this.close();
      }
    });
  }

  toggle(): void {
    if (this.panel.hidden) {
      const { activeElement } = document;
      this.openedFrom = activeElement instanceof HTMLElement ? activeElement : null;
      this.panel.hidden = false;
      this.opener.setAttribute("aria-expanded", "true");
      this.boxes[0]?.focus();
    } else {
      this.close();
    }
  }

  private close(): void {
    this.panel.hidden = true;
    this.opener.setAttribute("aria-expanded", "false");
    this.openedFrom?.focus({ preventScroll: true });
  }

  private write(): void {
    const shown = this.boxes.filter((box) => box.checked).map(layerOf);
    try {
      localStorage.setItem(KEY, JSON.stringify(shown));
    } catch {
      // Without storage the choice lasts until the page is left.
    }
  }
}

function layerOf(box: HTMLInputElement): Layer {
  const name = LAYERS.find((layer) => layer === box.dataset["layer"]);
  if (name === undefined) {
    throw new Error(`No such layer: ${box.dataset["layer"] ?? ""}`);
  }
  return name;
}

function read(): readonly Layer[] {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(KEY) ?? "null");
    return Array.isArray(stored) ? LAYERS.filter((layer) => stored.includes(layer)) : SHOWN_AT_FIRST;
  } catch {
    return SHOWN_AT_FIRST;
  }
}
