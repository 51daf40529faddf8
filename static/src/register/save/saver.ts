/**
 * Keeps work safe: a draft in this browser with every edit, the server when asked, and merging when
 * somebody else saved meanwhile. Points that are not complete stay in the draft.
 */
import { ApiProblem, Unreachable, explain } from "../../api";
import { showFlash } from "../../page/flashes";
import { randomKey } from "../../random-key";
import type { RegistrationApi, Saved } from "../api";
import type { Editor } from "../editor";
import type { DraftBox } from "../model/draft";
import { merge } from "../model/merge";
import { isComplete, samePoints, type Points } from "../model/point";
import { askMerge } from "./merge-dialog";

export type SaveState = "saved" | "changed" | "saving" | "offline" | "signed-out";

export class Saver {
  private state: SaveState = "saved";
  /** One key for one content: sent again after a lost answer, it is stored once. */
  private attempt: { readonly points: Points; readonly version: number; readonly key: string } | null = null;
  private isBusy = false;

  constructor(
    private readonly editor: Editor,
    private readonly api: RegistrationApi,
    private readonly drafts: DraftBox,
    private readonly dialog: HTMLDialogElement,
    private readonly onState: (state: SaveState) => void,
  ) {
    editor.listen((changes) => {
      if (changes.has("points")) {
        this.keepDraft();
      }
    });
  }

  /** Takes up a draft of this browser; one begun from an older state is merged first. */
  async restore(): Promise<void> {
    const draft = this.drafts.read();
    const { editor } = this;
    if (draft === null || !editor.mayEdit || samePoints(draft.points, editor.saved)) {
      this.drafts.clear();
      return;
    }
    if (draft.version === editor.version) {
      editor.edit(draft.points, "restore the draft");
      showFlash("Your unsaved changes are back. Undo takes them away again.", "info");
      return;
    }
    const points = await this.merged(draft.base, draft.points, editor.saved);
    if (points === null) {
      showFlash("The saved keypoints are shown; your draft stays in this browser.", "warning");
    } else {
      editor.edit(points, "merge the draft");
    }
  }

  /** Saves what is complete. True when the server has it. */
  async save(): Promise<boolean> {
    const { editor } = this;
    if (this.isBusy || !editor.mayEdit) {
      return false;
    }
    this.isBusy = true;
    this.report("saving");
    try {
      await this.rename();
      this.settle(await this.put());
      return true;
    } catch (error) {
      return await this.recover(error);
    } finally {
      this.isBusy = false;
    }
  }

  private async put(): Promise<Saved> {
    const { editor } = this;
    const isSame = this.attempt?.points === editor.points && this.attempt.version === editor.version;
    if (!isSame || this.attempt === null) {
      this.attempt = { points: editor.points, version: editor.version, key: randomKey() };
    }
    return this.api.save(editor.complete, editor.version, this.attempt.key);
  }

  private settle(saved: Saved): void {
    const { editor } = this;
    editor.settle(saved.points, saved.version);
    this.attempt = null;
    this.keepDraft();
    void this.readLandmarks();
    const waiting = editor.points.filter((point) => !isComplete(point)).length;
    if (waiting > 0) {
      const what = waiting === 1 ? "1 keypoint lacks" : `${waiting} keypoints lack`;
      showFlash(`Saved. ${what} a place or a pixel and stays in this browser until it is complete.`, "info");
    }
  }

  private async recover(error: unknown): Promise<boolean> {
    this.keepDraft();
    if (error instanceof Unreachable) {
      this.report("offline");
      showFlash("The server cannot be reached. Your work is kept in this browser; save again later.", "warning");
    } else if (error instanceof ApiProblem && error.status === 401) {
      this.report("signed-out");
    } else if (error instanceof ApiProblem && (error.status === 412 || error.status === 428)) {
      this.isBusy = false;
      return this.mergeAndSave();
    } else if (error instanceof ApiProblem && error.fields.length > 0) {
      this.explainFields(error);
    } else {
      showFlash(`Not saved. ${explain(error)}`, "error");
    }
    return false;
  }

  private async mergeAndSave(): Promise<boolean> {
    const { editor } = this;
    const theirs = await this.api.keypoints();
    await this.readLandmarks();
    const points = await this.merged(editor.saved, editor.points, theirs.points);
    if (points === null) {
      showFlash("Not saved: somebody else changed these keypoints. Save again to merge.", "warning");
      return false;
    }
    editor.settle(theirs.points, theirs.version);
    editor.edit(points, "merge");
    return this.save();
  }

  private async merged(base: Points, mine: Points, theirs: Points): Promise<Points | null> {
    const found = merge(base, mine, theirs);
    if (found.taken.length === 0 && found.conflicts.length === 0) {
      return found.resolve(new Map());
    }
    return askMerge(this.dialog, found, base);
  }

  /** A landmark has one name for all viewports: it is changed at the landmark itself. */
  private async rename(): Promise<void> {
    const { editor } = this;
    const renamed = editor.complete.flatMap((point) => {
      const landmark = editor.landmarks.find(({ id }) => id === point.landmarkId);
      return landmark !== undefined && landmark.name !== point.name ? [{ landmark, name: point.name }] : [];
    });
    for (const { landmark, name } of renamed) {
      await this.api.rename(landmark, name);
    }
    if (renamed.length > 0) {
      await this.readLandmarks();
    }
  }

  async readLandmarks(): Promise<void> {
    this.editor.landmarks = await this.api.landmarks();
    this.editor.tell("landmarks");
  }

  private explainFields(problem: ApiProblem): void {
    const { editor } = this;
    const complete = editor.complete;
    const lines = problem.fields.map(({ field, message }) => {
      const point = complete[Number(/^keypoints\.(\d+)/.exec(field)?.[1] ?? Number.NaN)];
      return { point, text: point === undefined ? `${field}: ${message}` : `${point.name}: ${message}` };
    });
    const first = lines.find(({ point }) => point !== undefined)?.point;
    if (first !== undefined) {
      editor.select(first.key);
    }
    showFlash(`Not saved. ${lines.map(({ text }) => text).join(" ")}`, "error");
  }

  private keepDraft(): void {
    const { editor } = this;
    if (!editor.isChanged) {
      this.drafts.clear();
      this.report("saved");
      return;
    }
    const { version, saved: base, points } = editor;
    const isKept = this.drafts.write({ version, base, points, savedAt: new Date().toISOString() });
    if (this.state !== "signed-out" && this.state !== "offline") {
      this.report("changed");
    }
    if (!isKept) {
      showFlash("This browser keeps no drafts: save often.", "warning");
    }
  }

  private report(state: SaveState): void {
    this.state = state;
    this.onState(state);
  }
}
