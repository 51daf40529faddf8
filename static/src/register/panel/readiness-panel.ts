/**
 * How far the registration is, in words: how many keypoints are missing, where the next one helps
 * most, what looks wrong and what is poor about the spread.
 */
import { element, part } from "../../page/parts";
import type { ReadinessAnswer, Suspicion } from "../api";
import type { Editor } from "../editor";

const WORDS: Readonly<Record<ReadinessAnswer["level"], readonly [word: string, tone: string]>> = {
  too_few: ["Needs keypoints", "warning"],
  refused: ["No solution", "danger"],
  poor: ["Poor", "danger"],
  fair: ["Fair", "warning"],
  good: ["Good", "success"],
};
const GOOD_COUNT = 10;

export class ReadinessPanel {
  constructor(
    private readonly root: HTMLElement,
    private readonly headline: HTMLElement,
    private readonly editor: Editor,
    onShowNext: () => void,
    private readonly onSelect: (key: string) => void,
  ) {
    part(root, "show-next").addEventListener("click", onShowNext);
    editor.listen((changes) => {
      if (changes.has("answer") || changes.has("points")) {
        this.render();
      }
    });
    this.render();
  }

  private render(): void {
    const { answer } = this.editor;
    if (answer === null) {
      return;
    }
    const { readiness, suspicions } = answer;
    const [word, tone] = WORDS[readiness.level];
    this.headline.className = `badge badge--${tone}`;
    this.headline.textContent = word;
    const progress = part(this.root, "readiness-bar") as HTMLProgressElement;
    progress.max = GOOD_COUNT;
    progress.value = Math.min(GOOD_COUNT, readiness.control_points);
    part(this.root, "readiness-count").textContent = countText(readiness);
    part(this.root, "readiness-sentences").replaceChildren(
      ...readiness.sentences
        .filter((sentence) => sentence !== readiness.next_point?.sentence)
        .map((sentence) => element("li", "", sentence)),
    );
    part(this.root, "suspicions").replaceChildren(...suspicions.map((one) => this.suspicion(one)));
    part(this.root, "suspicions").hidden = suspicions.length === 0;
    const warnings = [...readiness.warnings, ...(answer.methods[0]?.warnings ?? [])];
    part(this.root, "readiness-warnings").replaceChildren(
      ...[...new Set(warnings)].map((warning) => element("li", "", warning)),
    );
    part(this.root, "readiness-warnings").hidden = warnings.length === 0;
    const next = readiness.next_point;
    part(this.root, "next-point").hidden = next === null;
    part(this.root, "show-next").hidden = readiness.control_points === 0;
    part(this.root, "next-sentence").textContent = next?.sentence ?? "";
  }

  private suspicion({ kind, keys, message }: Suspicion): HTMLLIElement {
    const item = element("li", "suspicion");
    item.append(element("p", "", message));
    const actions = element("div", "row");
    const [first, second] = keys.map((key) => this.editor.points.find((point) => point.key === key));
    if (first !== undefined) {
      actions.append(button(`Show ${first.name}`, () => {
        this.onSelect(first.key);
      }));
    }
    if (kind === "swapped" && first !== undefined && second !== undefined && this.editor.mayEdit) {
      actions.append(button("Exchange their pixels", () => {
        const points = this.editor.points.map((point) =>
          point.key === first.key
            ? { ...point, pixel: second.pixel }
            : point.key === second.key
              ? { ...point, pixel: first.pixel }
              : point,
        );
        this.editor.edit(points, `exchange ${first.name} and ${second.name}`);
      }));
    }
    item.append(actions);
    return item;
  }
}

function countText({ control_points: count, missing_for_solution, missing_for_good }: ReadinessAnswer): string {
  const have = `${count} control keypoint${count === 1 ? "" : "s"}`;
  if (missing_for_solution > 0) {
    return `${have}: ${missing_for_solution} more until it can be solved`;
  }
  if (missing_for_good === 0) {
    return `${have}: enough`;
  }
  return `${have}: ${missing_for_good} more ${missing_for_good === 1 ? "is" : "are"} asked for`;
}

function button(text: string, onClick: () => void): HTMLButtonElement {
  const made = element("button", "button button--small", text);
  made.type = "button";
  made.addEventListener("click", onClick);
  return made;
}
