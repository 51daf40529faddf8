/**
 * The photograph with everything drawn on it: the viewer, its layers, the loupe and the gestures.
 * A click on an empty place goes to the editor.
 */
import { element } from "../../page/parts";
import { DragPan } from "../../viewer/gestures/drag-pan";
import { PinchZoom } from "../../viewer/gestures/pinch-zoom";
import { WheelZoom } from "../../viewer/gestures/wheel-zoom";
import { toImage } from "../../viewer/view";
import { Viewer } from "../../viewer/viewer";
import type { ImageJson } from "../api";
import type { Editor } from "../editor";
import { Loupe } from "./loupe";
import { NameLayout } from "./name-layout";
import { PointGestures } from "./point-gestures";
import { PointLayer } from "./point-layer";
import { ProjectionLayer, type Projected } from "./projection-layer";
import { ResidualLayer } from "./residual-layer";
import { WaterLayer } from "./water-layer";

/** Image pixels around a point that should be in sight with it. */
const AROUND_PX = 30;

export class ImagePane {
  readonly viewer: Viewer;
  readonly loupe: Loupe;
  readonly residuals: ResidualLayer;
  readonly projections: ProjectionLayer;
  readonly water: WaterLayer;
  private readonly points: PointLayer;
  private imageUrl = "";

  constructor(
    surface: HTMLElement,
    private readonly editor: Editor,
  ) {
    this.viewer = new Viewer(surface);
    this.viewer.setFraming("image");
    this.loupe = new Loupe(surface);
    this.water = new WaterLayer(editor);
    this.residuals = new ResidualLayer(editor);
    this.projections = new ProjectionLayer(editor, ({ landmark, pixel }) => {
      editor.adopt(landmark, pixel);
      this.focusPoint();
    });
    this.points = new PointLayer(editor, (key) => {
      if (editor.selectedKey !== key) {
        editor.select(key);
      }
    });
    const names = new NameLayout((view) => [...this.points.names(view), ...this.projections.names(view)]);
    for (const layer of [this.water, this.residuals, this.projections, this.points, names]) {
      this.viewer.add(layer);
    }
    const pick = (key: string): void => {
      editor.select(key);
      this.viewer.render(); // a point just made has no mark before
      this.points.focus(key);
    };
    new PointGestures(this.viewer, editor, this.loupe, pick);
    new DragPan(this.viewer, (at) => {
      const placed = editor.place(toImage(this.viewer.currentView(), at));
      if (placed !== null) {
        pick(placed.key);
      }
    });
    new PinchZoom(this.viewer);
    new WheelZoom(this.viewer);
    surface.append(element("div", "register-middle"));
  }

  show(image: ImageJson): void {
    const { width_px: width, height_px: height } = image;
    this.imageUrl = image.file_url;
    this.viewer.show(
      {
        previewUrl: image.preview_url,
        fullUrl: image.file_url,
        size: { width, height },
        description: `Photograph ${image.file_name}`,
      },
      null,
    );
    this.loupe.setSource(null);
    this.viewer.fulls.load(image.file_url).then(
      (full) => {
        if (this.imageUrl === image.file_url) {
          this.loupe.setSource(full);
        }
      },
      () => undefined, // the viewer says that the photograph cannot be loaded
    );
  }

  /** Begins a keypoint in the middle of the view, for those without a pointer. */
  placeInMiddle(): void {
    const { clientWidth, clientHeight } = this.viewer.surface;
    const middle = toImage(this.viewer.currentView(), [clientWidth / 2, clientHeight / 2]);
    if (this.editor.place(middle) !== null) {
      this.focusPoint();
    }
  }

  /** Takes the projected landmark nearest to the middle of the view as a draft. */
  adoptNearest(): void {
    const { clientWidth, clientHeight } = this.viewer.surface;
    const [u, v] = toImage(this.viewer.currentView(), [clientWidth / 2, clientHeight / 2]);
    const away = ({ pixel }: Projected): number => Math.hypot(pixel[0] - u, pixel[1] - v);
    const [nearest] = this.projections.candidates().sort((a, b) => away(a) - away(b));
    if (nearest !== undefined && this.editor.mayEdit) {
      this.editor.adopt(nearest.landmark, nearest.pixel);
      this.focusPoint();
    }
  }

  /** Brings the selected point in sight and gives it the keyboard. */
  focusPoint(): void {
    const { selected } = this.editor;
    if (selected?.pixel !== null && selected !== null) {
      this.reveal();
      this.viewer.render();
      this.points.focus(selected.key);
    }
  }

  /** Brings the selected point in sight. */
  reveal(): void {
    const pixel = this.editor.selected?.pixel ?? null;
    if (pixel !== null) {
      const [u, v] = pixel;
      this.viewer.reveal({
        x1: u - AROUND_PX,
        y1: v - AROUND_PX,
        x2: u + AROUND_PX,
        y2: v + AROUND_PX,
      });
    }
  }
}
