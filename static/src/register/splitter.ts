/**
 * A bar between two parts that moves by hand or arrows and remembers its place. The share of the
 * first part is a custom property of the frame, so that the layout stays the stylesheet's.
 */
export interface SplitterOptions {
  readonly bar: HTMLElement;
  readonly frame: HTMLElement;
  readonly property: string;
  readonly axis: "x" | "y";
  readonly share: number;
  readonly least: number;
  readonly most: number;
  readonly storageKey: string;
}

const STEP = 0.02;

export class Splitter {
  private share: number;

  constructor(private readonly options: SplitterOptions) {
    const { bar, storageKey, share } = options;
    const kept = Number(read(storageKey) ?? Number.NaN);
    this.share = Number.isFinite(kept) && kept > 0 ? kept : share;
    this.apply(this.share);
    bar.addEventListener("pointerdown", (event) => {
      bar.setPointerCapture(event.pointerId);
      event.preventDefault();
      bar.focus();
    });
    bar.addEventListener("pointermove", (event) => {
      if (bar.hasPointerCapture(event.pointerId)) {
        this.apply(this.shareAt(event));
      }
    });
    bar.addEventListener("pointerup", () => {
      this.keep();
    });
    bar.addEventListener("dblclick", () => {
      this.apply(share);
      this.keep();
    });
    bar.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -STEP, ArrowUp: -STEP, ArrowRight: STEP, ArrowDown: STEP }[event.key];
      if (by !== undefined) {
        event.preventDefault();
        event.stopPropagation();
        this.apply(this.share + by);
        this.keep();
      }
    });
  }

  private shareAt(event: PointerEvent): number {
    const box = this.options.frame.getBoundingClientRect();
    return this.options.axis === "x"
      ? (event.clientX - box.left) / box.width
      : (event.clientY - box.top) / box.height;
  }

  private apply(share: number): void {
    const { bar, frame, property, least, most } = this.options;
    this.share = Math.min(most, Math.max(least, share));
    frame.style.setProperty(property, `${(this.share * 100).toFixed(2)}%`);
    bar.setAttribute("aria-valuenow", String(Math.round(this.share * 100)));
  }

  private keep(): void {
    try {
      localStorage.setItem(this.options.storageKey, this.share.toFixed(4));
    } catch {
      // Without storage it is as wide as usual the next time.
    }
  }
}

function read(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}
