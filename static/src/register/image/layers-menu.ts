/** What is drawn on the photograph: ticked in a menu, remembered in this browser. */
import { part } from "../../page/parts";
import type { Editor } from "../editor";
import type { ImagePane } from "./image-pane";
import { ARROW_SCALES, type ArrowScale } from "./residual-layer";
import { WATER_PARTS } from "./water-layer";

const STORAGE_KEY = "quaymark.register.layers";

interface Kept {
  readonly arrows: number;
  readonly off: readonly string[];
  readonly on: readonly string[];
}

export class LayersMenu {
  private readonly menu: HTMLElement;
  private readonly opener: HTMLElement;
  private readonly ticks: readonly HTMLInputElement[];
  private readonly radios: readonly HTMLInputElement[];

  constructor(
    private readonly root: HTMLElement,
    private readonly pane: ImagePane,
    private readonly editor: Editor,
  ) {
    this.menu = part(root, "layers");
    this.opener = part(root, "layers-opener");
    this.ticks = [...root.querySelectorAll<HTMLInputElement>("[data-layer]")];
    this.radios = [...root.querySelectorAll<HTMLInputElement>("input[name=arrows]")];
    this.restore();
    this.menu.addEventListener("change", () => {
      this.apply();
    });
    editor.listen((changes) => {
      if (changes.has("figures")) {
        this.showLegend();
      }
    });
    this.apply();
  }

  toggle(): void {
    this.menu.hidden = !this.menu.hidden;
    this.opener.setAttribute("aria-expanded", String(!this.menu.hidden));
  }

  /** True when it was open. */
  close(): boolean {
    const wasOpen = !this.menu.hidden;
    if (wasOpen) {
      this.toggle();
      this.opener.focus();
    }
    return wasOpen;
  }

  nextArrows(): void {
    const now = this.radios.findIndex(({ checked }) => checked);
    const next = this.radios[(now + 1) % this.radios.length];
    if (next !== undefined) {
      next.checked = true;
      this.apply();
    }
  }

  toggleLoupe(): void {
    const loupe = this.ticks.find((tick) => tick.dataset["layer"] === "loupe");
    if (loupe !== undefined) {
      loupe.checked = !loupe.checked;
      this.apply();
    }
  }

  private isOn(layer: string): boolean {
    return this.ticks.some((tick) => tick.dataset["layer"] === layer && tick.checked);
  }

  private apply(): void {
    const { pane } = this;
    const scale = Number(this.radios.find(({ checked }) => checked)?.value ?? 10);
    pane.residuals.scale = ARROW_SCALES.find((one) => one === scale) ?? (10 satisfies ArrowScale);
    pane.projections.isShown = this.isOn("projections");
    for (const name of WATER_PARTS) {
      if (this.isOn(name)) {
        pane.water.shown.add(name);
      } else {
        pane.water.shown.delete(name);
      }
    }
    pane.loupe.isOn = this.isOn("loupe");
    this.showLegend();
    pane.viewer.requestRender();
    this.keep(scale);
  }

  /** Colours are explained only where a solution has coloured the water. */
  private showLegend(): void {
    part(this.root, "heat-legend").hidden = !this.isOn("heat") || this.editor.figures === null;
  }

  private keep(arrows: number): void {
    const names = (checked: boolean): string[] =>
      this.ticks.filter((tick) => tick.checked === checked).map((tick) => tick.dataset["layer"] ?? "");
    const kept: Kept = { arrows, on: names(true), off: names(false) };
    try {
      localStorage.setItem(STORAGE_KEY, JSON.stringify(kept));
    } catch {
      // Without storage the usual layers are there the next time.
    }
  }

  private restore(): void {
    try {
      const kept = JSON.parse(localStorage.getItem(STORAGE_KEY) ?? "null") as Kept | null;
      for (const tick of kept === null ? [] : this.ticks) {
        const layer = tick.dataset["layer"] ?? "";
        tick.checked = kept?.on.includes(layer) === true || (tick.checked && kept?.off.includes(layer) !== true);
      }
      for (const radio of kept === null ? [] : this.radios) {
        radio.checked = Number(radio.value) === kept?.arrows;
      }
    } catch {
      // What cannot be read is not restored.
    }
  }
}
