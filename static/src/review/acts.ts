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
import { toImage, type Point } from "../viewer/view";
import { Viewer } from "../viewer/viewer";
import { EditMode } from "./edit/edit-mode";
import { FactsPanel } from "./facts-panel";
import { LayersMenu } from "./layers-menu";
import { MissedMode } from "./missed/missed-mode";
import { MODE_NAMES, showModes, type ModeMachine } from "./modes";
import { drawn, extent, poseAt, vesselName, type Pose } from "./pose";
import { RematchMode } from "./rematch/rematch-mode";
import type { Scene, Stage } from "./stage";
import { SurroundingsStore } from "./surroundings";
import { SurroundingsView } from "./surroundings-view";

export type { Scene } from "./stage";

const FRAMING_NAMES: Readonly<Record<Framing, string>> = {
  object: "Fit box",
  image: "Fit image",
  free: "Free view",
};

export interface ActsHooks {
  /** Another pose of the image was chosen on the photograph. */
  onSelect(poseId: number): void;
  /** A pose as the server now has it: corrected, matched anew, or made by hand. */
  onPoseChanged(pose: Pose): void;
}

export class ReviewActs {
  readonly viewer: Viewer;
  readonly layers: LayersMenu;
  private readonly overlay = new PoseOverlay();
  private readonly panel: FactsPanel;
  private readonly around: SurroundingsView;
  private readonly rematch: RematchMode;
  private scene: Scene | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly machine: ModeMachine,
    private readonly hooks: ActsHooks,
  ) {
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
    this.panel = new FactsPanel(part(root, "panel"), root.dataset["timeZone"] ?? "UTC");
    const store = new SurroundingsStore(Number(root.dataset["run"]));
    this.around = new SurroundingsView(this.viewer, this.panel, store);
    this.viewer.add(this.overlay);
    this.layers = new LayersMenu(
      part(root, "layers"),
      part(root, "layers-opener"),
      this.viewer.surface,
      root.dataset["user"] ?? "",
    );
    const stage = this.stageOf(store);
    this.rematch = new RematchMode(stage);
    // Before the viewer's gestures, so that a mode may take a drag for itself.
    for (const mode of [new EditMode(stage), this.rematch, new MissedMode(stage)]) {
      machine.add(mode);
    }
    new WheelZoom(this.viewer);
    new PinchZoom(this.viewer);
    new DragPan(this.viewer, (at) => {
      this.tap(toImage(this.viewer.currentView(), at));
    });
    showModes(root, machine);
    machine.onChange(() => {
      if (!this.isReviewing()) {
        this.viewer.surface.scrollIntoView({ block: "nearest" });
      }
    });
    this.listenToButtons();
  }

  /** Shows an image and its pose; the same pose again renews only what is said of it. */
  show(scene: Scene): void {
    const before = this.scene;
    const isSame =
      before?.image.id === scene.image.id && before.pose?.id === scene.pose?.id;
    this.scene = scene;
    if (!isSame && !this.isReviewing()) {
      this.machine.leave(); // what is edited belongs to the pose that was shown
    }
    if (scene.pose === null) {
      this.panel.showImageAlone(scene.image, wordsOf(scene));
    } else {
      this.panel.show(scene.pose, scene.grade);
    }
    if (!isSame || before.poses !== scene.poses || before.pose !== scene.pose) {
      this.overlay.setPoses(scene.poses.map(drawn), scene.pose?.id ?? null);
      this.around.show(scene);
      this.viewer.requestRender();
    }
    if (!isSame) {
      this.showPhotograph(scene);
    }
  }

  setPeek(peeking: boolean): void {
    this.viewer.setOverlayHidden(peeking);
  }

  private showPhotograph({ image, pose }: Scene): void {
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

  private tap(at: Point): void {
    if (this.machine.current === this.rematch) {
      this.rematch.tap(at);
      return;
    }
    const pose = poseAt(this.scene?.poses ?? [], at);
    if (pose !== null && this.isReviewing()) {
      this.hooks.onSelect(pose.id);
    }
  }

  private isReviewing(): boolean {
    return ["review", "reasons"].includes(this.machine.current.name);
  }

  private stageOf(store: SurroundingsStore): Stage {
    return {
      root: this.root,
      viewer: this.viewer,
      machine: this.machine,
      around: store,
      user: this.root.dataset["user"] ?? "",
      scene: () => this.scene,
      poseChanged: (pose) => {
        this.hooks.onPoseChanged(pose);
      },
      surroundingsChanged: () => {
        if (this.scene !== null) {
          this.around.show(this.scene);
        }
      },
      announce: (words) => {
        part(this.root, "announcement").textContent = words;
      },
    };
  }

  /** Buttons say which mode they begin (data-enters) or which command they are (data-command). */
  private listenToButtons(): void {
    this.root.addEventListener("click", (event) => {
      const button = event.target instanceof Element ? event.target.closest("button") : null;
      const mode = MODE_NAMES.find((name) => name === button?.dataset["enters"]);
      const command = button?.dataset["command"];
      if (mode !== undefined) {
        this.machine.enter(mode);
      } else if (command?.startsWith(`${this.machine.current.name}.`) === true) {
        this.machine.current.act(command, { fine: event.shiftKey });
      }
    });
  }
}

function wordsOf({ poses }: Scene): string {
  return poses.length === 0
    ? "No box was made here. Mark every vessel you see, then say that the image is complete."
    : "Is every visible vessel accounted for?";
}
