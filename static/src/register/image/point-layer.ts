/**
 * The keypoints on the photograph: each a focusable mark, named for screen readers.
 *
 * A mark has a shape for its role (control a ring with a cross, check a square, off a dashed ring),
 * so that nothing is told by colour alone; the name stands beside it when there is room.
 */
import { number } from "../../format";
import { toScreen, type View } from "../../viewer/view";
import type { Overlay } from "../../viewer/viewer";
import type { Editor } from "../editor";
import type { Point, Role } from "../model/point";
import type { NamedMark } from "./name-layout";
import { svgElement } from "./svg";

const RADIUS = 8;

interface Mark {
  readonly group: SVGGElement;
  readonly shape: SVGPathElement;
  readonly casing: SVGPathElement;
  readonly label: SVGTextElement;
}

export class PointLayer implements Overlay {
  readonly hasControls = true;
  private group: SVGGElement | null = null;
  private readonly marks = new Map<string, Mark>();

  constructor(
    private readonly editor: Editor,
    private readonly onFocus: (key: string) => void,
  ) {}

  attach(group: SVGGElement): void {
    group.classList.add("register-points");
    this.group = group;
  }

  draw(view: View): void {
    const shown = this.editor.points.filter(({ pixel }) => pixel !== null);
    for (const [key, mark] of this.marks) {
      if (!shown.some((point) => point.key === key)) {
        mark.group.remove();
        this.marks.delete(key);
      }
    }
    for (const point of shown) {
      this.place(this.marks.get(point.key) ?? this.make(point.key), point, view);
    }
  }

  names(view: View): NamedMark[] {
    return this.editor.points.flatMap((point) => {
      const mark = this.marks.get(point.key);
      if (mark === undefined || point.pixel === null) {
        return [];
      }
      const [x, y] = toScreen(view, point.pixel);
      const { group, label } = mark;
      return [{ group, label, name: point.name, x, y, gap: RADIUS + 5, rank: this.rank(point) }];
    });
  }

  private rank({ key, place }: Point): number {
    return key === this.editor.selectedKey ? 0 : place === null ? 1 : 2;
  }

  focus(key: string): void {
    this.marks.get(key)?.group.focus({ preventScroll: true });
  }

  private make(key: string): Mark {
    const group = svgElement("g", "register-point", { tabindex: 0, role: "slider" });
    const casing = svgElement("path", "register-point__casing");
    const shape = svgElement("path", "register-point__shape");
    const label = svgElement("text", "register-point__label", { y: 4.5 });
    group.append(casing, shape, label);
    group.addEventListener("focus", () => {
      this.onFocus(key);
    });
    this.group?.append(group);
    const mark = { group, casing, shape, label };
    this.marks.set(key, mark);
    return mark;
  }

  private place({ group, casing, shape, label }: Mark, point: Point, view: View): void {
    const { pixel, key, name, role } = point;
    if (pixel === null) {
      return;
    }
    const [x, y] = toScreen(view, pixel);
    const isSelected = key === this.editor.selectedKey;
    const errors = this.editor.figures?.errors.get(key);
    const outlier = this.editor.figures?.outliers.has(key) === true;
    group.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
    group.dataset["key"] = key;
    group.dataset["role"] = role;
    group.classList.toggle("is-selected", isSelected);
    group.classList.toggle("is-outlier", outlier);
    group.classList.toggle("is-waiting", point.place === null);
    const path = shapeOf(role, isSelected ? RADIUS + 3 : RADIUS);
    casing.setAttribute("d", path);
    shape.setAttribute("d", path);
    label.textContent = name;
    group.setAttribute("aria-label", name);
    group.setAttribute("aria-valuenow", pixel[0].toFixed(2));
    group.setAttribute("aria-valuemin", "-0.5");
    group.setAttribute("aria-valuemax", String(this.editor.world.intrinsics.widthPx - 0.5));
    const error = errors?.errorPx ?? null;
    const state = point.place === null ? "waits for its place" : outlier ? "does not agree" : role;
    group.setAttribute(
      "aria-valuetext",
      `u ${number(pixel[0], 2)}, v ${number(pixel[1], 2)} px, ${state}` +
        (error === null ? "" : `, residual ${number(error, 2)} px`),
    );
  }
}

/** A cross with a gap around the very pixel, inside of the shape of the role. */
function shapeOf(role: Role, r: number): string {
  const gap = 2.5;
  const cross = `M${-r - 3} 0H${-gap}M${gap} 0H${r + 3}M0 ${-r - 3}V${-gap}M0 ${gap}V${r + 3}`;
  switch (role) {
    case "control":
      return `${circle(r)}${cross}`;
    case "check":
      return `M${-r} ${-r}H${r}V${r}H${-r}Z${cross}`;
    case "off":
      return `${circle(r)}M${-r * 0.7} ${r * 0.7}L${r * 0.7} ${-r * 0.7}`;
  }
}

function circle(r: number): string {
  return `M${-r} 0A${r} ${r} 0 1 1 ${r} 0A${r} ${r} 0 1 1 ${-r} 0Z`;
}
