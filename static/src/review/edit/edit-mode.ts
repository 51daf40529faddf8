/**
 * Edit mode: a person puts the box right. The wireframe follows every key and drag at once; the
 * server is asked only at the beginning and at the end, and keeps the generated pose beside it.
 */
import { ApiProblem, call, explain, Unreachable } from "../../api";
import type { Camera } from "../../geometry/camera";
import { showFlash } from "../../page/flashes";
import type { Point } from "../../viewer/view";
import { withCorrection, type Correction } from "../correction";
import type { Mode, Press } from "../modes";
import { vesselName, type Pose } from "../pose";
import type { Stage } from "../stage";
import { bearingsFrom, type Bearings, type LocalBox } from "./box";
import { ConflictDialog } from "./conflict";
import { dragged, type Handle } from "./drag";
import { Drafts } from "./draft";
import { EDIT_COMMANDS } from "./edit-commands";
import { EditOverlay } from "./edit-overlay";
import { EditPanel } from "./edit-panel";
import { cameraOf, type EditView } from "./edit-view";
import { Handles } from "./handles";
import { differences, merged } from "./merge";
import { stepped } from "./steps";

/** What is edited now. */
interface Work {
  readonly pose: Pose;
  readonly camera: Camera;
  readonly bearings: Bearings;
  readonly generated: LocalBox;
  /** As the server has it, and its version. */
  saved: LocalBox;
  version: number;
  draft: LocalBox;
  isCorrected: boolean;
}

interface Grip {
  readonly handle: Handle;
  readonly from: Point;
  readonly start: LocalBox;
}

/** Commands of the handles, by the arrow pressed on them. */
const NUDGES: Readonly<Record<Exclude<Handle, "move">, readonly [less: string, more: string]>> = {
  turn: ["edit.turn-left", "edit.turn-right"],
  bow: ["edit.shorter", "edit.longer"],
  stern: ["edit.shorter", "edit.longer"],
  port: ["edit.narrower", "edit.wider"],
  starboard: ["edit.narrower", "edit.wider"],
  top: ["edit.lower", "edit.higher"],
};

export class EditMode implements Mode {
  readonly name = "edit";
  readonly title = "Editing the box";
  readonly hint = "Drag the box or its handles, or use the keys beside the figures";
  readonly commands = EDIT_COMMANDS;
  private readonly overlay = new EditOverlay();
  private readonly handles: Handles;
  private readonly panel: EditPanel;
  private readonly conflict: ConflictDialog;
  private readonly drafts: Drafts;
  private work: Work | null = null;
  private grip: Grip | null = null;
  private entered = 0;

  constructor(private readonly stage: Stage) {
    this.panel = new EditPanel(stage.root);
    this.conflict = new ConflictDialog(stage.root.ownerDocument);
    this.drafts = new Drafts(localStorage, stage.user);
    this.handles = new Handles(stage.viewer, {
      onGrip: (handle, from) => {
        this.grip = this.work === null ? null : { handle, from, start: this.work.draft };
      },
      onDrag: (to) => {
        if (this.work !== null && this.grip !== null) {
          const { start, handle, from } = this.grip;
          this.change(dragged(this.work.camera, start, handle, from, to));
        }
      },
      onRelease: () => {
        this.grip = null;
        this.keepDraft();
      },
      onNudge: (handle, sign, fine) => {
        if (handle !== "move") {
          this.act(NUDGES[handle][sign === 1 ? 1 : 0], { fine });
        }
      },
    });
    stage.viewer.add(this.overlay);
    stage.viewer.add(this.handles);
  }

  enter(): boolean {
    const pose = this.stage.scene()?.pose ?? null;
    if (pose === null) {
      showFlash("There is no box to edit here. Choose a pose first.", "info");
      return false;
    }
    this.entered += 1;
    void this.begin(pose, this.entered);
    return true;
  }

  leave(): void {
    this.work = null;
    this.grip = null;
    this.overlay.hide();
    this.handles.hide();
    this.panel.close();
  }

  act(commandId: string, press: Press): void {
    const { work } = this;
    if (commandId === "edit.cancel") {
      this.cancel();
    } else if (work === null) {
      return; // not loaded yet
    } else if (commandId === "edit.save") {
      void this.save(work);
    } else if (commandId === "edit.reset") {
      void this.reset(work);
    } else {
      const box = stepped(commandId, press, work.draft, work.bearings);
      if (box !== null) {
        this.change(box);
        this.keepDraft();
      }
    }
  }

  private async begin(pose: Pose, entered: number): Promise<void> {
    let view: EditView;
    try {
      view = await readEdit(pose.id);
    } catch (error) {
      if (this.entered === entered) {
        this.stage.machine.leave();
        showFlash(`The box cannot be edited now. ${explain(error)}`, "error");
      }
      return;
    }
    if (this.entered !== entered || this.stage.machine.current !== this) {
      return; // left again, or another pose's turn
    }
    const camera = cameraOf(view.camera);
    const draft = this.drafts.read(pose.id);
    this.work = {
      pose,
      camera,
      bearings: bearingsFrom(camera),
      generated: view.generated,
      saved: view.current,
      // Of a draft: should somebody have saved since, saving leads to the merge by hand.
      version: draft?.version ?? view.version,
      draft: draft?.box ?? view.current,
      isCorrected: view.correction !== null,
    };
    if (draft !== null) {
      showFlash("Your changes that were not saved are back.", "info");
    }
    this.panel.open(vesselName(pose), this.work.isCorrected);
    this.change(this.work.draft);
    this.stage.viewer.surface.focus({ preventScroll: true });
  }

  private change(box: LocalBox): void {
    const { work } = this;
    if (work !== null) {
      work.draft = box;
      this.overlay.show(work.camera, work.generated, box);
      this.handles.show(work.camera, box);
      this.panel.show(work.generated, box, work.bearings);
    }
  }

  private keepDraft(): void {
    if (this.work !== null) {
      this.drafts.write(this.work.pose.id, this.work.draft, this.work.version);
    }
  }

  private cancel(): void {
    if (this.work !== null) {
      this.drafts.forget(this.work.pose.id);
    }
    this.stage.machine.leave();
  }

  private async save(work: Work): Promise<void> {
    if (differences(work.generated, work.draft, work.saved, work.bearings).length === 0) {
      this.cancel(); // nothing to save
      return;
    }
    const { key } =
      this.drafts.read(work.pose.id) ??
      this.drafts.write(work.pose.id, work.draft, work.version);
    this.panel.setBusy(true);
    try {
      const correction = (await call(`/api/v1/poses/${work.pose.id}/corrections`, {
        method: "POST",
        json: bodyOf(work.draft),
        ifMatch: work.version,
        idempotencyKey: key,
      })) as Correction;
      this.drafts.forget(work.pose.id);
      this.finish(work, correction, correction.version, "The corrected box is saved.");
    } catch (error) {
      this.panel.setBusy(false);
      await this.explainRefusal(work, error);
    }
  }

  private async reset(work: Work): Promise<void> {
    this.panel.setBusy(true);
    try {
      const { version } = (await call(`/api/v1/poses/${work.pose.id}/corrections`, {
        method: "DELETE",
        ifMatch: work.version,
      })) as { readonly version: number };
      this.drafts.forget(work.pose.id);
      this.finish(work, null, version, "The generated box stands again.");
    } catch (error) {
      this.panel.setBusy(false);
      await this.explainRefusal(work, error);
    }
  }

  private finish(
    work: Work,
    correction: Correction | null,
    version: number,
    words: string,
  ): void {
    if (this.work === work) {
      this.stage.machine.leave();
    }
    this.stage.poseChanged(withCorrection(work.pose, correction, version));
    this.stage.announce(words);
  }

  private async explainRefusal(work: Work, error: unknown): Promise<void> {
    if (error instanceof ApiProblem && error.status === 412) {
      await this.resolveConflict(work).catch((late: unknown) => {
        showFlash(`Not saved. ${explain(late)} Your changes are kept here.`, "error");
      });
      return;
    }
    const signIn = error instanceof ApiProblem && error.status === 401;
    const again = error instanceof Unreachable || signIn;
    const hint = signIn ? " Sign in in another tab, then save again." : " Then save again.";
    const kept = again ? `${hint} Your changes are kept.` : "";
    showFlash(`The box was not saved. ${explain(error)}${kept}`, "error");
  }

  private async resolveConflict(work: Work): Promise<void> {
    const { current, version, correction } = await readEdit(work.pose.id);
    const who = correction?.user ?? null;
    const differing = differences(work.generated, work.draft, current, work.bearings);
    const choice =
      differing.length === 0
        ? ({ kind: "theirs" } as const)
        : await this.conflict.ask(told(who, correction === null), differing);
    if (this.work !== work) {
      return;
    }
    work.version = version;
    work.saved = current;
    work.isCorrected = correction !== null;
    if (choice.kind === "theirs") {
      this.drafts.forget(work.pose.id);
      this.finish(work, correction, version, "Their box is kept.");
    } else if (choice.kind === "merge") {
      this.change(merged(work.draft, current, choice.sides));
      this.keepDraft();
      await this.save(work);
    } else {
      this.keepDraft(); // on the version that has been seen now
    }
  }
}

function told(who: string | null, isReset: boolean): string {
  const somebody = who ?? "Somebody";
  return isReset
    ? "Somebody took this box back to the generated one while you were editing."
    : `${somebody} saved another correction of this box while you were editing.`;
}

async function readEdit(poseId: number): Promise<EditView> {
  return (await call(`/api/v1/poses/${poseId}/edit`)) as EditView;
}

function bodyOf(box: LocalBox): Omit<LocalBox, "up_m"> {
  const { east_m, north_m, heading_deg, length_m, width_m, height_m } = box;
  return { east_m, north_m, heading_deg, length_m, width_m, height_m };
}
