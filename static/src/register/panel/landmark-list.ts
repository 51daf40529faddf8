/**
 * The landmarks of the site, found by name: placed here, projected into the photograph by the
 * present fit, or not seen. Picking one makes it the waiting keypoint's place, or arms it for the
 * next click on the photograph.
 */
import { element, part } from "../../page/parts";
import type { Editor } from "../editor";
import type { Landmark } from "../model/point";
import type { ProjectionLayer } from "../image/projection-layer";

export class LandmarkList {
  private readonly search: HTMLInputElement;
  private readonly list: HTMLElement;
  private readonly onPick: (landmark: Landmark) => void;

  constructor(
    root: HTMLElement,
    private readonly options: HTMLDataListElement,
    private readonly editor: Editor,
    private readonly projections: ProjectionLayer,
    onPick: (landmark: Landmark) => void,
  ) {
    this.onPick = (landmark) => {
      this.search.value = "";
      onPick(landmark);
    };
    this.search = part(root, "landmark-search") as HTMLInputElement;
    this.list = part(root, "landmark-list");
    this.search.addEventListener("input", () => {
      this.render();
    });
    this.search.addEventListener("keydown", (event) => {
      const [first] = this.found();
      if (event.key === "Enter" && first !== undefined) {
        event.preventDefault();
        this.onPick(first);
      }
    });
    editor.listen((changes) => {
      if (!editor.isDragging && (["points", "selection", "landmarks", "answer"] as const).some((change) => changes.has(change))) {
        this.render();
      }
    });
    this.render();
  }

  focus(): void {
    this.search.focus();
    this.search.select();
  }

  private found(): Landmark[] {
    const wanted = this.search.value.trim().toLocaleLowerCase();
    return this.editor.landmarks.filter(({ name }) => name.toLocaleLowerCase().includes(wanted));
  }

  private render(): void {
    const projected = new Map(this.projections.candidates().map((one) => [one.landmark.id, one]));
    const found = this.found();
    this.list.replaceChildren(
      ...found.map((landmark) => this.row(landmark, projected.has(landmark.id))),
      ...(found.length === 0 ? [this.nothing()] : []),
    );
    const names = this.editor.landmarks.map(({ name }) => {
      const option = element("option");
      option.value = name;
      return option;
    });
    this.options.replaceChildren(...names);
  }

  private row(landmark: Landmark, isProjected: boolean): HTMLLIElement {
    const { points, armed } = this.editor;
    const point = points.find(({ landmarkId }) => landmarkId === landmark.id);
    const button = element("button", "landmark");
    button.type = "button";
    button.setAttribute("aria-pressed", String(armed?.id === landmark.id));
    const state =
      armed?.id === landmark.id
        ? "click the photograph"
        : point !== undefined
          ? point.pixel === null ? "needs a pixel" : "placed"
          : isProjected
            ? "seen by the fit"
            : this.editor.figures === null ? "not placed" : "not in the picture";
    button.append(
      element("span", "landmark__name", landmark.name),
      element("span", `landmark__state is-${point !== undefined ? "placed" : isProjected ? "projected" : "unseen"}`, state),
    );
    button.addEventListener("click", () => {
      this.onPick(landmark);
    });
    const item = element("li");
    item.append(button);
    return item;
  }

  private nothing(): HTMLLIElement {
    const text =
      this.editor.landmarks.length === 0
        ? "This site has no landmarks yet. Click the photograph and give the place, or import a CSV or GeoJSON file."
        : `No landmark is named like “${this.search.value}”.`;
    return element("li", "muted landmark-none", text);
  }
}
