/**
 * The figures of the run, beside the work: how much is Good, how much acceptable, how sure that is,
 * and how many more grades it takes to be surer. Nobody is compared with anybody.
 */
import { call } from "../api";
import type { components } from "../api-types";
import { number } from "../format";
import { part } from "../page/parts";

type Figures = components["schemas"]["ReviewFiguresOut"];
type Share = Figures["good"];

const KEY = "quaymark.figures";
const EVERY_MS = 5_000;

export class LiveFigures {
  private readonly card: HTMLElement;
  private askedMs = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly query: string,
  ) {
    this.card = part(root, "figures");
    this.setOpen(readOpen());
  }

  toggle(): void {
    this.setOpen(this.card.hidden);
    try {
      localStorage.setItem(KEY, this.card.hidden ? "" : "open");
    } catch {
      // Without storage they are closed again on the next page.
    }
  }

  /** Grades have arrived: the figures may be others. */
  changed(): void {
    if (this.card.hidden || this.timer !== null) {
      return;
    }
    const wait = Math.max(0, this.askedMs + EVERY_MS - Date.now());
    this.timer = setTimeout(() => {
      this.timer = null;
      void this.bring();
    }, wait);
  }

  private setOpen(open: boolean): void {
    this.card.hidden = !open;
    for (const button of this.root.querySelectorAll("[data-act='review.figures']")) {
      button.setAttribute("aria-expanded", String(open));
    }
    if (open) {
      void this.bring();
    }
  }

  private async bring(): Promise<void> {
    this.askedMs = Date.now();
    try {
      this.show((await call(`/api/v1/evaluation/reviews?${this.query}`)) as Figures);
    } catch {
      part(this.card, "figures-more").textContent = "The figures cannot be fetched now.";
    }
  }

  private show(figures: Figures): void {
    part(this.card, "figures-good").textContent = inWords(figures.good);
    part(this.card, "figures-acceptable").textContent = inWords(figures.acceptable);
    const { half_width: width, good, acceptable } = figures.wanted;
    const more = Math.max(good.more_of_these, acceptable.more_of_these);
    const precision = `± ${number(100 * width)} %`;
    part(this.card, "figures-more").textContent =
      more === 0
        ? `${precision} is reached.`
        : `${precision} needs about ${number(more)} more of ${number(figures.ungraded)} ungraded.`;
  }
}

function inWords({ share, interval, count, total }: Share): string {
  if (share === null || total === 0) {
    return "–";
  }
  const [low, high] = interval.map((value) => number(100 * value));
  return `${number(100 * share, 1)} % (${low ?? ""} to ${high ?? ""}), ${number(count)} of ${number(total)}`;
}

function readOpen(): boolean {
  try {
    return localStorage.getItem(KEY) === "open";
  } catch {
    return false;
  }
}
