/**
 * One cell of the table while it is edited: a field in its place, its error below it. Enter and Tab
 * take the value, Escape leaves it as it was.
 */
import { element } from "../../page/parts";
import type { Editor } from "../editor";
import type { Column } from "../model/order";
import { ROLES, type Point } from "../model/point";
import { changeOf, fieldText, type Cell } from "./cells";

/** How a field was left: by a key that stays in the row, along it, or by going elsewhere. */
export type Leaving = "stay" | "next" | "previous" | "away";

export class CellField {
  private readonly input: HTMLInputElement | HTMLSelectElement;
  private readonly error = element("p", "field__error cell-error");
  private isOpen = true;

  constructor(
    private readonly cell: HTMLTableCellElement,
    private readonly point: Point,
    readonly column: Column,
    private readonly editor: Editor,
    { title }: Cell,
    private readonly onLeave: (how: Leaving) => void,
  ) {
    this.input = column === "role" ? roleSelect() : element("input", "");
    this.input.classList.add("input", "cell-input");
    this.input.value = fieldText(point, column);
    this.input.setAttribute("aria-label", `${title} of ${point.name}`);
    this.error.id = `cell-error-${column}`;
    this.error.hidden = true;
    this.error.setAttribute("role", "alert");
    cell.replaceChildren(this.input, this.error);
    this.input.addEventListener("keydown", this.onKey as EventListener);
    this.input.addEventListener("blur", () => {
      this.finish("away");
    });
    if (this.input instanceof HTMLSelectElement) {
      this.input.addEventListener("change", () => {
        this.finish("stay");
      });
    }
    this.input.focus();
    if (this.input instanceof HTMLInputElement) {
      this.input.select();
    }
  }

  holds(key: string, column: Column): boolean {
    return this.isOpen && this.point.key === key && this.column === column;
  }

  get key(): string {
    return this.point.key;
  }

  private readonly onKey = (event: KeyboardEvent): void => {
    event.stopPropagation();
    if (event.key === "Escape") {
      event.preventDefault();
      this.close("stay");
    } else if (event.key === "Enter") {
      event.preventDefault();
      this.finish("stay");
    } else if (event.key === "Tab") {
      event.preventDefault();
      this.finish(event.shiftKey ? "previous" : "next");
    }
  };

  private finish(how: Leaving): void {
    if (!this.isOpen) {
      return;
    }
    const text = this.input.value;
    if (text === fieldText(this.point, this.column)) {
      this.close(how);
      return;
    }
    const point = this.editor.points.find(({ key }) => key === this.point.key) ?? this.point;
    const change = changeOf(point, this.column, text, this.editor);
    if (change.error !== undefined) {
      this.error.textContent = change.error;
      this.error.hidden = false;
      this.input.setAttribute("aria-invalid", "true");
      this.input.setAttribute("aria-describedby", this.error.id);
      this.cell.scrollIntoView({ block: "nearest", inline: "nearest" });
      return;
    }
    this.editor.change(point.key, change.value, `change ${point.name}`);
    this.close(how);
  }

  private close(how: Leaving): void {
    this.isOpen = false;
    this.onLeave(how);
  }
}

function roleSelect(): HTMLSelectElement {
  const select = element("select");
  for (const role of ROLES) {
    const option = element("option", "", role);
    option.value = role;
    select.append(option);
  }
  return select;
}
