/**
 * The methods side by side, the one with the least leave-one-out error first in line, and what PnP
 * says of the camera. The two homographies are the paper's, for comparison.
 */
import { heading, number } from "../../format";
import { element, part } from "../../page/parts";
import type { CameraAnswer, Method, MethodAnswer, SolveAnswer } from "../api";
import type { Editor } from "../editor";

const NAMES: Readonly<Record<Method, string>> = {
  pnp: "PnP",
  homography_water: "Homography, water",
  homography_pca: "Homography, PCA",
};

export class MethodsPanel {
  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
  ) {
    editor.listen((changes) => {
      if (changes.has("answer")) {
        this.render();
      }
    });
    this.render();
  }

  private render(): void {
    const { answer } = this.editor;
    const isSolved = answer?.methods.some(({ leave_one_out_px }) => leave_one_out_px !== null) ?? false;
    part(this.root, "methods-none").hidden = isSolved;
    part(this.root, "methods-solved").hidden = !isSolved;
    if (answer === null || !isSolved) {
      return;
    }
    const best = bestOf(answer.methods);
    part(this.root, "method-rows").replaceChildren(
      ...answer.methods.map((method) => methodRow(method, method === best)),
    );
    part(this.root, "method-points").replaceChildren(...pointRows(answer, this.editor));
    part(this.root, "camera-facts").replaceChildren(
      ...(answer.camera === null ? [] : cameraFacts(answer.camera)),
    );
    part(this.root, "camera-title").hidden = answer.camera === null;
  }
}

export function bestOf(methods: readonly MethodAnswer[]): MethodAnswer | null {
  const judged = methods.filter(({ leave_one_out_px }) => leave_one_out_px !== null);
  return judged.reduce<MethodAnswer | null>(
    (best, next) =>
      best === null || (next.leave_one_out_px ?? Infinity) < (best.leave_one_out_px ?? Infinity) ? next : best,
    null,
  );
}

function methodRow(answer: MethodAnswer, leads: boolean): HTMLTableRowElement {
  const row = element("tr", leads ? "is-best" : "");
  const head = element("th", "", NAMES[answer.method]);
  head.scope = "row";
  if (leads) {
    head.append(" ", element("span", "badge badge--success", "leads"));
  }
  row.append(head);
  if (answer.error !== null) {
    const cell = element("td", "method-error", answer.error);
    cell.colSpan = 5;
    row.append(cell);
    return row;
  }
  const strong = element("td", "is-number");
  strong.append(element("strong", "", number(answer.leave_one_out_px, 2)));
  row.append(
    strong,
    element("td", "is-number", number(answer.mae_px, 2)),
    element("td", "is-number", number(answer.mae_pct_width, 3)),
    element("td", "is-number", number(answer.mae_pct_height, 3)),
    element("td", "is-number", number(answer.check_mae_px, 2)),
  );
  return row;
}

/** Leave-one-out of each keypoint by each method; check points by their plain error. */
function pointRows(answer: SolveAnswer, editor: Editor): HTMLTableRowElement[] {
  const byMethod = answer.methods.map(({ points }) => new Map(points.map((point) => [point.key, point])));
  const judged = (index: number, key: string): number | null => {
    const point = byMethod[index]?.get(key);
    return point?.leave_one_out_px ?? point?.error_px ?? null;
  };
  return editor.complete
    .filter(({ role }) => role !== "off")
    .sort((a, b) => (judged(0, b.key) ?? -1) - (judged(0, a.key) ?? -1))
    .map(({ key, name, role }) => {
      const row = element("tr");
      const head = element("th", "", role === "check" ? `${name} (check)` : name);
      head.scope = "row";
      row.append(head, ...answer.methods.map((_, index) => element("td", "is-number", number(judged(index, key), 1))));
      return row;
    });
}

function cameraFacts(camera: CameraAnswer): HTMLElement[] {
  const { intrinsics, refined_from: own, center_sigma_m: sigma } = camera;
  const focal = own === null ? "as calibrated" : `refined from ${number(own.fx_px, 1)}`;
  const facts: readonly (readonly [string, string])[] = [
    ["Height", `${number(camera.height_above_water_m, 2)} m above the water`],
    ["Looks", `${heading(camera.heading_deg)}, ${number(Math.abs(camera.pitch_deg), 2)}° ${camera.pitch_deg < 0 ? "down" : "up"}, roll ${number(camera.roll_deg, 2)}°`],
    ["Position ±", sigma === null ? "–" : `${number(sigma[0], 2)} m E, ${number(sigma[1], 2)} m N, ${number(sigma[2], 2)} m up`],
    ["fx", `${number(intrinsics.fx_px, 1)} px, ${focal}`],
    ["k1", `${number(intrinsics.distortion[0], 4)}${own === null ? "" : `, refined from ${number(own.distortion[0], 4)}`}`],
    ["On the water", camera.water_sigma_px === null ? "–" : `± ${number(camera.water_sigma_px, 2)} px at ${number(camera.water_sigma_range_m)} m`],
  ];
  return facts.flatMap(([name, value]) => [element("dt", "", name), element("dd", "", value)]);
}
