/**
 * Re-match mode: says which vessel a detection shows. The candidates stand in a list and on the
 * photograph; picking one lets the server compute the pose anew, beside the generated one.
 */
import { ApiProblem, call, explain } from "../../api";
import { showFlash } from "../../page/flashes";
import { randomKey } from "../../random-key";
import { boundsOf, type Point, type Rect } from "../../viewer/view";
import { versionOf, withCorrection } from "../correction";
import type { Command, Mode } from "../modes";
import { detectionRect, points, vesselName, type Pose } from "../pose";
import type { Scene, Stage } from "../stage";
import type { FoundBox } from "../surroundings";
import { CandidateOverlay } from "./candidate-overlay";
import {
  loadCandidates,
  makePose,
  nameOf,
  rematchPose,
  type Candidate,
  type Target,
} from "./candidates";
import { RematchPanel } from "./rematch-panel";
import type { VesselId } from "../../vessel-id";

const DIGITS = [1, 2, 3, 4, 5, 6, 7, 8, 9] as const;
/** A pointer this near, in pixels of the image, still means a candidate. */
const REACH_PX = 12;

const COMMANDS: readonly Command[] = [
  ...DIGITS.map((digit) => ({
    id: `rematch.${digit}`,
    codes: [`Digit${digit}`, `Numpad${digit}`],
    meaning: `Take candidate ${digit}`,
  })),
  { id: "rematch.next", codes: ["ArrowDown", "KeyJ"], repeats: true, meaning: "Next candidate" },
  {
    id: "rematch.previous",
    codes: ["ArrowUp", "KeyK"],
    repeats: true,
    meaning: "Previous candidate",
  },
  { id: "rematch.take", codes: ["Enter", "NumpadEnter"], meaning: "Take the chosen candidate" },
  { id: "rematch.detection", codes: ["KeyD"], meaning: "Next detection without a box" },
  { id: "rematch.cancel", codes: ["Escape", "KeyR"], meaning: "Leave the match as it is" },
];

export class RematchMode implements Mode {
  readonly name = "rematch";
  readonly title = "Matching anew";
  readonly hint = "Pick the vessel in the list or on the photograph";
  readonly commands = COMMANDS;
  private readonly overlay = new CandidateOverlay();
  private readonly panel: RematchPanel;
  private target: Target | null = null;
  private free: readonly FoundBox[] = [];
  private candidates: readonly Candidate[] = [];
  private chosen = 0;
  private busy = false;
  private entered = 0;

  constructor(private readonly stage: Stage) {
    this.panel = new RematchPanel(stage.root, {
      onPick: (index) => {
        void this.take(index);
      },
      onPoint: (index) => {
        this.choose(index);
      },
      onTarget: (box) => {
        void this.aim({ kind: "detection", box });
      },
    });
    stage.viewer.add(this.overlay);
  }

  enter(): boolean {
    const scene = this.stage.scene();
    if (scene === null) {
      return false;
    }
    this.free = [];
    this.entered += 1;
    if (scene.pose !== null) {
      void this.aim({ kind: "pose", pose: scene.pose });
    }
    void this.loadFree(scene, this.entered);
    return true;
  }

  leave(): void {
    this.target = null;
    this.candidates = [];
    this.overlay.hide();
    this.panel.close();
  }

  act(commandId: string): void {
    const digit = DIGITS.find((value) => commandId === `rematch.${value}`);
    if (digit !== undefined) {
      void this.take(digit - 1);
      return;
    }
    switch (commandId) {
      case "rematch.next":
        this.choose(this.chosen + 1);
        break;
      case "rematch.previous":
        this.choose(this.chosen - 1);
        break;
      case "rematch.take":
        void this.take(this.chosen);
        break;
      case "rematch.detection":
        this.aimAtNext();
        break;
      case "rematch.cancel":
        this.stage.machine.leave();
        break;
    }
  }

  /** A tap on the photograph: a candidate, or another detection. */
  tap([u, v]: Point): void {
    const isIn = (rect: Rect | null): boolean =>
      rect !== null &&
      u >= rect.x1 - REACH_PX &&
      u <= rect.x2 + REACH_PX &&
      v >= rect.y1 - REACH_PX &&
      v <= rect.y2 + REACH_PX;
    const index = this.candidates.findIndex(({ segment_px: segment }) =>
      isIn(boundsOf(points(segment))),
    );
    const box = this.free.find((found) => isIn(rectOf(found)));
    if (index >= 0) {
      void this.take(index);
    } else if (box !== undefined) {
      void this.aim({ kind: "detection", box });
    }
  }

  private async aim(target: Target): Promise<void> {
    const scene = this.stage.scene();
    if (scene === null) {
      return;
    }
    this.target = target;
    this.candidates = [];
    this.panel.open(
      target.kind === "pose"
        ? `Now matched with ${vesselName(target.pose)}.`
        : "A detection without a box.",
    );
    this.showFree();
    this.draw();
    try {
      const { candidates, refused } = await loadCandidates(target, scene.runId);
      if (this.target !== target) {
        return; // another one is meant by now
      }
      this.candidates = candidates;
      this.panel.showCandidates(candidates, refused);
      this.choose(Math.max(0, candidates.findIndex(({ current }) => !current)));
      this.stage.announce(`${candidates.length} candidates`);
    } catch (error) {
      if (this.target === target) {
        this.stage.machine.leave();
        showFlash(`The candidates could not be loaded. ${explain(error)}`, "error");
      }
    }
  }

  /** The detections without a box: to choose from, and the first of them where no pose is shown. */
  private async loadFree(scene: Scene, entered: number): Promise<void> {
    const { around, machine } = this.stage;
    // Always a moment later, when this mode has begun.
    const known = await (around.of(scene.image.id) ?? around.load(scene.image.id).catch(() => null));
    if (this.entered !== entered || machine.current !== this) {
      return;
    }
    this.free = (known?.detections ?? []).filter(({ pose_id: pose }) => pose === null);
    const [first] = this.free;
    if (this.target !== null) {
      this.showFree();
      this.draw();
    } else if (first !== undefined) {
      void this.aim({ kind: "detection", box: first });
    } else {
      machine.leave();
      showFlash("There is no detection to match here. Mark the vessel as missed instead.", "info");
    }
  }

  private aimAtNext(): void {
    const { target } = this;
    const at = target?.kind === "detection" ? this.free.indexOf(target.box) : -1;
    const next = this.free[(at + 1) % Math.max(1, this.free.length)];
    if (next === undefined) {
      showFlash("Every detection of this image has a box.", "info");
    } else {
      void this.aim({ kind: "detection", box: next });
    }
  }

  private choose(index: number): void {
    this.chosen = Math.max(0, Math.min(this.candidates.length - 1, index));
    this.panel.choose(this.chosen);
    this.draw();
  }

  private showFree(): void {
    const { target } = this;
    this.panel.showFree(
      this.free.filter((box) => target?.kind !== "detection" || box.id !== target.box.id),
    );
  }

  private draw(): void {
    if (this.target === null) {
      return;
    }
    const { target } = this;
    this.overlay.show({
      target: target.kind === "pose" ? detectionRect(target.pose) : rectOf(target.box),
      others: this.free
        .filter((box) => target.kind !== "detection" || box.id !== target.box.id)
        .map(rectOf),
      candidates: this.candidates.map((candidate, index) => ({
        label: `${index + 1} ${nameOf(candidate)}`,
        segment: points(candidate.segment_px),
      })),
      chosen: this.chosen,
    });
    this.stage.viewer.requestRender();
  }

  private async take(index: number): Promise<void> {
    const { target } = this;
    const scene = this.stage.scene();
    const candidate = this.candidates[index];
    if (target === null || scene === null || candidate === undefined || this.busy) {
      return;
    }
    if (candidate.current) {
      this.stage.machine.leave(); // it is matched with this vessel already
      return;
    }
    this.busy = true;
    try {
      const pose = await this.matched(target, candidate.mmsi, scene.runId);
      if (this.target === target) {
        this.stage.machine.leave();
      }
      if (target.kind === "detection") {
        const taken = (box: FoundBox): FoundBox =>
          box.id === target.box.id ? { ...box, pose_id: pose.id } : box;
        const known = this.stage.around.of(scene.image.id)?.detections ?? [];
        this.stage.around.change(scene.image.id, { detections: known.map(taken) });
      }
      this.stage.poseChanged(pose);
      this.stage.announce(`Matched with ${nameOf(candidate)}.`);
    } catch (error) {
      const isStale = error instanceof ApiProblem && error.status === 412;
      if (isStale && target.kind === "pose") {
        await this.showTheirs(target.pose);
      } else {
        showFlash(`${nameOf(candidate)} was not taken. ${explain(error)}`, "error");
      }
    } finally {
      this.busy = false;
    }
  }

  /** Somebody else corrected the pose meanwhile: theirs is shown before anything replaces it. */
  private async showTheirs(pose: Pose): Promise<void> {
    try {
      const theirs = (await call(`/api/v1/poses/${pose.id}`)) as Pose;
      this.stage.poseChanged(theirs);
      await this.aim({ kind: "pose", pose: theirs });
      showFlash("Somebody else changed this pose meanwhile. Theirs is shown; pick again.", "warning");
    } catch (error) {
      showFlash(`The pose could not be loaded again. ${explain(error)}`, "error");
    }
  }

  private async matched(target: Target, mmsi: VesselId, runId: number): Promise<Pose> {
    if (target.kind === "detection") {
      return makePose(target.box, runId, mmsi, randomKey());
    }
    const { pose } = target;
    const correction = await rematchPose(pose, mmsi, versionOf(pose), randomKey());
    return withCorrection(pose, correction, correction.version);
  }
}

function rectOf({ x1_px: x1, y1_px: y1, x2_px: x2, y2_px: y2 }: FoundBox): Rect {
  return { x1, y1, x2, y2 };
}
