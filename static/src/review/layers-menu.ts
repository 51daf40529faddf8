/**
 * Which layers are drawn: tick boxes in a small panel, remembered for each person in this browser.
 *
 * A layer that is switched off is hidden by the stylesheet (`hides-NAME` on the viewer), so that
 * neither the drawing nor its order changes.
 */

export const LAYERS = [
  "detection",
  "reported",
  "dead_reckoned",
  "corrected",
  "box",
  "axes",
  "generated",
  "vessels",
  "horizon",
] as const;
export type Layer = (typeof LAYERS)[number];

const KEY = "quaymark.layers";
const SHOWN_AT_FIRST: readonly Layer[] = ["detection", "corrected", "box", "generated"];

export class LayersMenu {
  private readonly boxes: readonly HTMLInputElement[];
  private readonly key: string;
  private openedFrom: HTMLElement | null = null;

  constructor(
    private readonly panel: HTMLElement,
    private readonly opener: HTMLElement,
    private readonly drawings: HTMLElement,
    user: string,
  ) {
    this.key = `${KEY}.${user}`;
    this.boxes = [...panel.querySelectorAll<HTMLInputElement>("input[data-layer]")];
    const shown = read(this.key);
    for (const box of this.boxes) {
      const layer = layerOf(box);
      box.checked = shown.includes(layer);
      this.apply(layer, box.checked);
      box.addEventListener("change", () => {
        this.apply(layer, box.checked);
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

  private apply(layer: Layer, shown: boolean): void {
    this.drawings.classList.toggle(`hides-${layer}`, !shown);
  }

  private close(): void {
    this.panel.hidden = true;
    this.opener.setAttribute("aria-expanded", "false");
    this.openedFrom?.focus({ preventScroll: true });
  }

  private write(): void {
    const shown = this.boxes.filter((box) => box.checked).map(layerOf);
    try {
      localStorage.setItem(this.key, JSON.stringify(shown));
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

function read(key: string): readonly Layer[] {
  try {
    const stored: unknown = JSON.parse(localStorage.getItem(key) ?? "null");
    return Array.isArray(stored) ? LAYERS.filter((layer) => stored.includes(layer)) : SHOWN_AT_FIRST;
  } catch {
    return SHOWN_AT_FIRST;
  }
}
