/**
 * What a reviewer sees and does of one image: the photograph with its drawings, the facts beside it,
 * and the modes in which a pose is corrected, matched anew, or a missed vessel is marked.
 *
 * The way from one pose to the next is not decided here: `show` is told what stands on the stage.
 */
import { part } from "../page/parts";
import type { Framing } from "../viewer/framing";
import { DragPan } from "../viewer/gestures/drag-pan";
import { PinchZoom } from "../viewer/gestures/pinch-zoom";
import { WheelZoom } from "../viewer/gestures/wheel-zoom";
import { PoseOverlay } from "../viewer/overlay/pose-overlay";
import { toImage } from "../viewer/view";
import { Viewer } from "../viewer/viewer";
import { FactsPanel } from "./facts-panel";
import { LayersMenu } from "./layers-menu";
import { showModes, type ModeMachine } from "./modes";
import { drawn, extent, poseAt, vesselName, type Grade, type Pose } from "./pose";

const FRAMING_NAMES: Readonly<Record<Framing, string>> = {
  object: "Fit box",
  image: "Fit image",
  free: "Free view",
};

/** What is on the stage. */
export interface Scene {
  readonly runId: number;
  readonly image: Pose["image"];
  /** The run's poses of this image. */
  readonly poses: readonly Pose[];
  /** The pose that is judged now; null for an image without one. */
  readonly pose: Pose | null;
  readonly grade: Grade | null;
}

export interface ActsHooks {
  /** Another pose of the image was chosen on the photograph. */
  onSelect(poseId: number): void;
}

export class ReviewActs {
  readonly viewer: Viewer;
  readonly layers: LayersMenu;
  private readonly overlay = new PoseOverlay();
  private readonly panel: FactsPanel;
  private scene: Scene | null = null;

  constructor(root: HTMLElement, machine: ModeMachine, hooks: ActsHooks) {
    this.viewer = new Viewer(
      part(root, "viewer"),
      (framing) => {
        part(root, "framing").textContent = FRAMING_NAMES[framing];
      },
      (sharpness) => {
        part(root, "note").textContent =
          sharpness === "failed"
            ? "The photograph could not be loaded. Step away and back to try again."
            : "Loading the photograph";
      },
    );
    this.viewer.add(this.overlay);
    new WheelZoom(this.viewer);
    new PinchZoom(this.viewer);
    new DragPan(this.viewer, (at) => {
      const pose = poseAt(this.scene?.poses ?? [], toImage(this.viewer.currentView(), at));
      if (pose !== null) {
        hooks.onSelect(pose.id);
      }
    });
    this.panel = new FactsPanel(part(root, "panel"));
    this.layers = new LayersMenu(
      part(root, "layers"),
      part(root, "layers-opener"),
      (layer, shown) => {
        this.overlay.setLayer(layer, shown);
      },
    );
    showModes(root, machine);
  }

  /** Shows an image and its pose; the same pose again renews only what is said of it. */
  show(scene: Scene): void {
    const before = this.scene;
    this.scene = scene;
    if (scene.pose !== null) {
      this.panel.show(scene.pose, scene.grade);
    }
    if (before?.image.id === scene.image.id && before.pose?.id === scene.pose?.id) {
      return;
    }
    const { image, pose } = scene;
    this.overlay.setPoses(scene.poses.map(drawn), pose?.id ?? null);
    const looking = pose === null ? "" : `, looking at ${vesselName(pose)}`;
    this.viewer.show(
      {
        previewUrl: image.preview_url,
        fullUrl: image.file_url,
        size: { width: image.width_px, height: image.height_px },
        description: `Photograph ${image.file_name}${looking}`,
      },
      pose === null ? null : extent(pose),
    );
  }

  setPeek(peeking: boolean): void {
    this.viewer.setOverlayHidden(peeking);
  }
}
