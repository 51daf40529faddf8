/**
 * All keypoints with their figures, worst first. A row is chosen by click or arrows; Enter, F2 or a
 * second click on a value edits it in its place. During a drag figures move and rows stay.
 */
import { element } from "../../page/parts";
import type { Change, Editor } from "../editor";
import { sorted, type Column } from "../model/order";
import { isComplete, type Point } from "../model/point";
import { CellField, type Leaving } from "./cell-field";
import { CELLS, textOf } from "./cells";

export class PointTable {
  private readonly body = element("tbody");
  private readonly heads = new Map<Column, HTMLTableCellElement>();
  private readonly rows = new Map<string, HTMLTableRowElement>();
  private order: string[] = [];
  private field: CellField | null = null;

  constructor(
    private readonly table: HTMLTableElement,
    private readonly empty: HTMLElement,
    private readonly editor: Editor,
    private readonly onChoose: (key: string) => void,
  ) {
    table.append(this.head(), this.body);
    this.body.addEventListener("click", this.onClick);
    this.body.addEventListener("dblclick", this.onDoubleClick);
    this.body.addEventListener("keydown", this.onKey);
    editor.listen((changes) => {
      this.show(changes);
    });
    this.render();
  }

  private head(): HTMLTableSectionElement {
    const row = element("tr");
    for (const { column, title, hint, isNumber } of CELLS) {
      const cell = element("th", isNumber ? "is-number" : "");
      cell.scope = "col";
      const button = element("button", "table-sort", title);
      button.type = "button";
      button.title = `${hint}. Sort by it.`;
      button.addEventListener("click", () => {
        this.sortBy(column, isNumber);
      });
      cell.append(button);
      this.heads.set(column, cell);
      row.append(cell);
    }
    const head = element("thead");
    head.append(row);
    return head;
  }

  private sortBy(column: Column, numbersFirst: boolean): void {
    const { sorting } = this.editor;
    const descending = sorting.column === column ? !sorting.descending : numbersFirst;
    this.editor.sorting = { column, descending };
    this.editor.tell("sorting");
  }

  private show(changes: ReadonlySet<Change>): void {
    if (changes.has("points") || changes.has("figures") || changes.has("sorting") || changes.has("selection")) {
      this.render();
    }
    if (changes.has("selection")) {
      this.rows.get(this.editor.selectedKey ?? "")?.scrollIntoView({ block: "nearest" });
    }
  }

  private render(): void {
    const { editor } = this;
    const { points, figures, sorting } = editor;
    this.empty.hidden = points.length > 0;
    this.table.hidden = points.length === 0;
    for (const [column, head] of this.heads) {
      if (column === sorting.column) {
        head.setAttribute("aria-sort", sorting.descending ? "descending" : "ascending");
      } else {
        head.removeAttribute("aria-sort");
      }
    }
    const keys = new Set(points.map(({ key }) => key));
    for (const [key, row] of this.rows) {
      if (!keys.has(key)) {
        row.remove();
        this.rows.delete(key);
      }
    }
    const isSettled = !editor.isDragging && this.field === null;
    const order = isSettled ? sorted(points, figures?.errors ?? new Map(), sorting) : points;
    for (const point of order) {
      this.fill(this.rows.get(point.key) ?? this.make(point.key), point);
    }
    if (isSettled) {
      this.arrange(order.map(({ key }) => key));
    }
  }

  /** Moves rows only when their order changed: the one with the focus must stay in the page. */
  private arrange(order: string[]): void {
    if (order.join() !== this.order.join() || this.body.children.length !== order.length) {
      const focused = document.activeElement;
      this.order = order;
      this.body.append(...order.flatMap((key) => this.rows.get(key) ?? []));
      if (focused instanceof HTMLElement && this.body.contains(focused)) {
        focused.focus({ preventScroll: true });
      }
    }
  }

  private make(key: string): HTMLTableRowElement {
    const row = element("tr");
    row.dataset["key"] = key;
    row.tabIndex = 0;
    for (const { column, isNumber } of CELLS) {
      const cell = element(column === "name" ? "th" : "td", isNumber ? "is-number" : "");
      cell.dataset["column"] = column;
      if (column === "name") {
        cell.scope = "row";
      }
      row.append(cell);
    }
    this.rows.set(key, row);
    this.body.append(row);
    return row;
  }

  private fill(row: HTMLTableRowElement, point: Point): void {
    const { figures, selectedKey } = this.editor;
    const isOutlier = figures?.outliers.has(point.key) === true;
    row.classList.toggle("is-selected", point.key === selectedKey);
    row.classList.toggle("is-outlier", isOutlier);
    row.classList.toggle("is-off", point.role === "off");
    row.setAttribute("aria-selected", String(point.key === selectedKey));
    CELLS.forEach(({ column }, index) => {
      const cell = row.cells[index];
      if (cell === undefined || this.field?.holds(point.key, column) === true) {
        return;
      }
      let text = textOf(point, column, figures?.errors.get(point.key));
      if (column === "name" && !isComplete(point)) {
        text += point.place === null ? " · needs a place" : " · needs a pixel";
      } else if (column === "role" && isOutlier) {
        text = "outlier";
      }
      if (cell.textContent !== text) {
        cell.textContent = text;
        cell.title = column === "name" ? text : "";
      }
    });
  }

  private readonly onClick = (event: MouseEvent): void => {
    const place = placeOf(event.target);
    if (place === null || event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement) {
      return;
    }
    const wasSelected = this.editor.selectedKey === place.key;
    this.onChoose(place.key);
    if (wasSelected && event.detail === 1) {
      this.edit(place.key, place.column);
    }
  };

  private readonly onDoubleClick = (event: MouseEvent): void => {
    const place = placeOf(event.target);
    if (place !== null) {
      this.edit(place.key, place.column);
    }
  };

  private readonly onKey = (event: KeyboardEvent): void => {
    const row = event.target instanceof HTMLTableRowElement ? event.target : null;
    const key = row?.dataset["key"];
    if (row === null || key === undefined || event.ctrlKey || event.altKey || event.metaKey) {
      return;
    }
    const neighbour = { ArrowDown: row.nextElementSibling, ArrowUp: row.previousElementSibling }[event.key];
    if (neighbour instanceof HTMLTableRowElement) {
      event.preventDefault();
      event.stopPropagation();
      this.onChoose(neighbour.dataset["key"] ?? "");
      neighbour.focus();
    } else if (event.key === "Enter" || event.key === "F2") {
      event.preventDefault();
      event.stopPropagation();
      this.edit(key, "name");
    } else if (event.key === " ") {
      event.preventDefault();
      this.onChoose(key);
    }
  };

  private edit(key: string, column: Column): void {
    const index = CELLS.findIndex((cell) => cell.column === column);
    const [kind, point] = [CELLS[index], this.editor.points.find((other) => other.key === key)];
    const cell = this.rows.get(key)?.cells[index];
    if (!this.editor.mayEdit || kind?.isEditable !== true || point === undefined || cell === undefined) {
      return;
    }
    if (this.field?.holds(key, column) === true) {
      return;
    }
    this.field = new CellField(cell, point, column, this.editor, kind, (how) => {
      this.leave(cell, key, index, how);
    });
  }

  private leave(cell: HTMLTableCellElement, key: string, index: number, how: Leaving): void {
    this.field = null;
    cell.replaceChildren();
    this.render();
    const step = how === "next" ? 1 : how === "previous" ? -1 : 0;
    const next = CELLS[index + step];
    if (step !== 0 && next?.isEditable === true) {
      this.edit(key, next.column);
    } else if (how !== "away") {
      this.rows.get(key)?.focus();
    }
  }
}

function placeOf(target: EventTarget | null): { key: string; column: Column } | null {
  const cell = target instanceof Element ? target.closest<HTMLElement>("[data-column]") : null;
  const key = cell?.closest("tr")?.dataset["key"];
  const column = cell?.dataset["column"] as Column | undefined;
  return key === undefined || column === undefined ? null : { key, column };
}
