/** The list of candidates beside the photograph: rank, name, cost with its terms, what speaks against. */
import { number, quantity } from "../../format";
import { element, part } from "../../page/parts";
import { costInWords } from "../cost";
import { shipType } from "../ship-type";
import type { FoundBox } from "../surroundings";
import { nameOf, type Candidate, type Refused } from "./candidates";

export interface RematchPanelHooks {
  onPick(index: number): void;
  onPoint(index: number): void;
  onTarget(box: FoundBox): void;
}

export class RematchPanel {
  private readonly panel: HTMLElement;

  constructor(
    root: HTMLElement,
    private readonly hooks: RematchPanelHooks,
  ) {
    this.panel = part(root, "rematch-panel");
  }

  open(what: string): void {
    this.panel.hidden = false;
    part(this.panel, "rematch-what").textContent = what;
    part(this.panel, "candidates").replaceChildren();
    part(this.panel, "rematch-empty").hidden = true;
    part(this.panel, "rematch-refused-box").hidden = true;
  }

  close(): void {
    this.panel.hidden = true;
  }

  showCandidates(candidates: readonly Candidate[], refused: readonly Refused[]): void {
    part(this.panel, "rematch-empty").hidden = candidates.length > 0;
    part(this.panel, "candidates").replaceChildren(
      ...candidates.map((candidate, index) => this.row(candidate, index)),
    );
    part(this.panel, "rematch-refused-box").hidden = refused.length === 0;
    part(this.panel, "rematch-refused-count").textContent = number(refused.length);
    part(this.panel, "rematch-refused").replaceChildren(
      ...refused.map((vessel) => element("li", "", `${nameOf(vessel)}: ${vessel.text}`)),
    );
  }

  showFree(boxes: readonly FoundBox[]): void {
    part(this.panel, "rematch-others").hidden = boxes.length === 0;
    part(this.panel, "free-detections").replaceChildren(
      ...boxes.map((box) => {
        const button = element("button", "button button--small");
        button.type = "button";
        const size = `${number(box.x2_px - box.x1_px)} × ${number(box.y2_px - box.y1_px)} px`;
        button.textContent = `${size}, score ${number(box.score, 2)}`;
        button.setAttribute("aria-label", `Match the detection of ${button.textContent}`);
        button.addEventListener("click", () => {
          this.hooks.onTarget(box);
        });
        const item = element("li");
        item.append(button);
        return item;
      }),
    );
  }

  choose(index: number): void {
    const rows = this.panel.querySelectorAll<HTMLElement>(".candidate");
    rows.forEach((row, at) => {
      row.classList.toggle("is-chosen", at === index);
    });
    const row = rows[index];
    const list = this.panel.parentElement;
    if (row !== undefined && list !== null) {
      keepInSight(list, row);
    }
  }

  private row(candidate: Candidate, index: number): HTMLElement {
    const button = element("button", "candidate");
    button.type = "button";
    const rank = element("span", "candidate__rank");
    rank.append(element("kbd", "kbd", index < 9 ? String(index + 1) : "–"));
    button.append(
      rank,
      element("strong", "", nameOf(candidate)),
      element("span", "candidate__cost number", number(candidate.cost, 3)),
      element("span", "muted small", about(candidate)),
      element("span", "muted small number", terms(candidate)),
    );
    if (candidate.current) {
      button.append(element("span", "badge badge--accent", "Matched now"));
    } else if (candidate.pose_id !== null) {
      button.append(element("span", "badge badge--warning", "Has another box"));
    }
    button.addEventListener("click", () => {
      this.hooks.onPick(index);
    });
    for (const pointing of ["pointerenter", "focus"] as const) {
      button.addEventListener(pointing, () => {
        this.hooks.onPoint(index);
      });
    }
    const item = element("li");
    item.append(button);
    return item;
  }
}

/** Scrolls the panel and never the page: the photograph stays where it is. */
function keepInSight(list: HTMLElement, row: HTMLElement): void {
  const [outer, inner] = [list.getBoundingClientRect(), row.getBoundingClientRect()];
  list.scrollTop += Math.min(0, inner.top - outer.top) + Math.max(0, inner.bottom - outer.bottom);
}

function about(candidate: Candidate): string {
  const size = `${number(candidate.length_m)} × ${quantity(candidate.width_m, "m")}`;
  const age = `heard ${quantity(candidate.age_s, "s", 0)} before`;
  return [shipType(candidate.ship_type), size, age].filter((words) => words !== null).join(", ");
}

function terms(candidate: Candidate): string {
  const { summands, dividedBy } = costInWords(candidate.cost_terms);
  const parts = summands.map(({ name, value }) => `${name} ${number(value, 3)}`);
  return [...parts, dividedBy === null ? null : `score ${number(dividedBy.value, 2)}`]
    .filter((words) => words !== null)
    .join(", ");
}
