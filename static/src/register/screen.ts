/**
 * The editor's screen: makes the parts, connects them, and carries out what keys and buttons ask.
 */
import { number } from "../format";
import { showFlash } from "../page/flashes";
import { part } from "../page/parts";
import { randomKey } from "../random-key";
import { explain } from "../api";
import type { ImageJson, Method, RegistrationApi } from "./api";
import { showBanners } from "./banners";
import type { Change, Editor } from "./editor";
import { FileExchange } from "./exchange/file-exchange";
import { ImagePane } from "./image/image-pane";
import { LayersMenu } from "./image/layers-menu";
import type { Action } from "./keymap";
import { RegisterKeys } from "./keys";
import { MapPane } from "./map/map-pane";
import { DraftBox } from "./model/draft";
import { nextWorst, sorted } from "./model/order";
import { KeypointForm } from "./panel/keypoint-form";
import { LandmarkList } from "./panel/landmark-list";
import { MethodsPanel } from "./panel/methods-panel";
import { PointTable } from "./panel/point-table";
import { ReadinessPanel } from "./panel/readiness-panel";
import { SideTabs } from "./panel/side-tabs";
import { PhotoChoice } from "./photo-choice";
import { Saver, type SaveState } from "./save/saver";
import { Solver, type SolverState } from "./solver";
import { Splitter } from "./splitter";

const SYNC_WORDS: Readonly<Record<SaveState, string>> = {
  saved: "Saved",
  changed: "Unsaved changes",
  saving: "Saving",
  offline: "Not saved: offline",
  "signed-out": "Not saved: sign in, then save again",
};

export class RegisterScreen {
  private readonly pane: ImagePane;
  private readonly map: MapPane;
  private readonly solver: Solver;
  private readonly saver: Saver;
  private readonly form: KeypointForm;
  private readonly landmarks: LandmarkList;
  private readonly tabs: SideTabs;
  private readonly layers: LayersMenu;
  private readonly photos: PhotoChoice;
  private readonly files: FileExchange;

  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
    private readonly api: RegistrationApi,
    images: readonly ImageJson[],
  ) {
    this.solver = new Solver(editor, api, (state, message) => {
      this.showSolver(state, message);
    });
    const drafts = new DraftBox(localStorage, root.dataset["user"] ?? "", Number(root.dataset["viewport"]));
    this.saver = new Saver(editor, api, drafts, dialog("register-merge"), (state) => {
      this.showSync(state);
    });
    this.split();
    this.pane = new ImagePane(part(root, "viewer"), editor);
    this.map = new MapPane(part(root, "map"), editor, tilesOf(root));
    this.layers = new LayersMenu(root, this.pane, editor);
    this.tabs = new SideTabs(root);
    const choose = (key: string): void => {
      editor.select(key);
      this.tabs.show("keypoint");
      this.reveal();
    };
    new PointTable(part(root, "table") as HTMLTableElement, part(root, "table-empty"), editor, choose);
    this.form = new KeypointForm(part(root, "keypoint"), editor);
    this.landmarks = new LandmarkList(
      part(root, "landmarks"),
      part(root, "landmark-names") as HTMLDataListElement,
      editor,
      this.pane.projections,
      (landmark) => {
        editor.pick(landmark);
        this.map.reveal(landmark.place);
        this.reveal();
      },
    );
    new MethodsPanel(part(root, "methods"), editor);
    new ReadinessPanel(part(root, "readiness"), part(root, "headline"), editor, () => {
      this.showNext();
    }, choose);
    this.files = new FileExchange(root, editor, dialog("register-import"), root.dataset["name"] ?? "keypoints");
    this.photos = new PhotoChoice(root, images, (image) => {
      this.pane.show(image);
    });
    showBanners(root, editor);
    editor.listen((changes) => {
      this.show(changes);
    });
    new RegisterKeys(root, editor, this.pane, (action) => {
      this.act(action);
    });
    root.addEventListener("click", (event) => {
      const name = event.target instanceof Element ? event.target.closest<HTMLElement>("[data-act]")?.dataset["act"] : undefined;
      const action = name === undefined ? null : actionOfButton(name);
      if (action !== null) {
        this.act(action);
      }
    });
  }

  async begin(): Promise<void> {
    this.photos.showFirst();
    this.solver.askSoon(0);
    this.editor.tell("points", "selection", "landmarks");
    await this.saver.restore();
    this.root.dataset["state"] = "ready";
  }

  act(action: Action): void {
    const { editor } = this;
    const { selectedKey } = editor;
    switch (action.kind) {
      case "role":
        if (selectedKey !== null) {
          editor.setRole(selectedKey, action.role);
        }
        break;
      case "step":
        this.step(action.by);
        break;
      case "image":
        this.photos.step(action.by);
        break;
      case "next-worst":
        this.choose(nextWorst(editor.points, editor.figures?.errors ?? new Map(), selectedKey)?.key ?? null);
        break;
      case "undo":
        editor.undo();
        break;
      case "redo":
        editor.redo();
        break;
      case "save":
        clearFlashes();
        void this.saver.save();
        break;
      case "register":
        void this.register();
        break;
      case "remove":
        if (selectedKey !== null) {
          editor.remove(selectedKey);
        }
        break;
      case "adopt":
        this.pane.adoptNearest();
        break;
      case "landmarks":
        this.tabs.show("landmarks");
        this.landmarks.focus();
        break;
      case "type-place":
        this.tabs.show("keypoint");
        this.form.focusPlace();
        break;
      case "arrows":
        this.layers.nextArrows();
        break;
      case "layers":
        this.layers.toggle();
        break;
      case "loupe":
        this.layers.toggleLoupe();
        break;
      case "fit":
        this.pane.viewer.setFraming("image");
        break;
      case "map":
        this.map.frameAll();
        break;
      case "import":
        this.files.choose();
        break;
      case "leave":
        this.leave();
        break;
      case "help":
        dialog("register-help").showModal();
        break;
    }
  }

  private choose(key: string | null): void {
    if (key !== null) {
      this.editor.select(key);
      this.tabs.show("keypoint");
      this.reveal();
      this.pane.focusPoint();
    }
  }

  private step(by: 1 | -1): void {
    const { editor } = this;
    const order = sorted(editor.points, editor.figures?.errors ?? new Map(), editor.sorting);
    const place = order.findIndex(({ key }) => key === editor.selectedKey);
    const next = place === -1 ? (by === 1 ? 0 : order.length - 1) : (place + by + order.length) % Math.max(1, order.length);
    this.choose(order[next]?.key ?? null);
  }

  private leave(): void {
    if (this.layers.close()) {
      return;
    }
    if (this.editor.armed !== null) {
      this.editor.arm(null);
    } else {
      this.editor.select(null);
      this.pane.viewer.surface.focus();
    }
  }

  private reveal(): void {
    const { selected } = this.editor;
    this.pane.reveal();
    const place = selected?.place ?? null;
    if (place !== null) {
      this.map.reveal(place);
    }
  }

  private showNext(): void {
    const box = this.editor.answer?.readiness.next_point?.box_px;
    if (box !== undefined) {
      this.pane.water.isAsked = true;
      const [x1, y1, x2, y2] = box;
      this.pane.viewer.reveal({ x1, y1, x2, y2 });
    }
  }

  private async register(): Promise<void> {
    const { editor, api } = this;
    clearFlashes();
    if (!editor.mayEdit || (editor.isChanged && !(await this.saver.save()))) {
      return;
    }
    const solved = editor.answer?.methods.filter(({ error }) => error === null) ?? [];
    // The newest solution with a pose is the one in use, so PnP comes last.
    const methods: Method[] = solved.map(({ method }) => method).sort((a, b) => Number(a === "pnp") - Number(b === "pnp"));
    try {
      for (const method of methods) {
        await api.register(method, randomKey());
      }
      const error = solved.find(({ method }) => method === "pnp")?.leave_one_out_px;
      showFlash(`Registered: leave-one-out error ${number(error, 2)} px. Runs started from now on use it.`, "success");
    } catch (error) {
      showFlash(`Not registered. ${explain(error)}`, "error");
    }
  }

  private show(changes: ReadonlySet<Change>): void {
    this.pane.viewer.render();
    if (changes.has("points") || changes.has("answer") || changes.has("saved")) {
      this.showButtons();
    }
    if (changes.has("selection") && this.editor.selected?.place === null) {
      this.tabs.show("keypoint");
    }
    if (changes.has("points")) {
      this.pane.water.isAsked = false;
    }
    if (changes.has("figures")) {
      this.showFigure();
    }
  }

  private showButtons(): void {
    const { editor } = this;
    if (!editor.mayEdit) {
      return;
    }
    const button = (name: string): HTMLButtonElement => part(this.root, name) as HTMLButtonElement;
    const [undo, redo] = [button("undo"), button("redo")];
    undo.disabled = editor.undoLabel === null;
    redo.disabled = editor.redoLabel === null;
    undo.title = editor.undoLabel === null ? "Nothing to undo" : `Undo: ${editor.undoLabel} (U)`;
    redo.title = editor.redoLabel === null ? "Nothing to redo" : `Redo: ${editor.redoLabel} (Shift U)`;
    button("save").disabled = !editor.isChanged;
    button("register").disabled = (editor.answer?.camera ?? null) === null;
  }

  private showFigure(): void {
    const loo = [...(this.editor.figures?.errors.values() ?? [])].flatMap(({ leaveOneOutPx }) => leaveOneOutPx ?? []);
    const mean = loo.length === 0 ? null : loo.reduce((sum, value) => sum + value, 0) / loo.length;
    part(this.root, "figure").textContent = mean === null ? "" : `${number(mean, 2)} px leave-one-out`;
    this.root.dataset["solveMs"] = this.solver.lastSolveMs.toFixed(2);
  }

  private showSolver(state: SolverState, message: string): void {
    this.root.dataset["solver"] = state;
    if (state === "failed") {
      showFlash(`The keypoints could not be solved. ${message}`, "error");
    }
  }

  private showSync(state: SaveState): void {
    part(this.root, "sync").dataset["state"] = state;
    part(this.root, "sync-text").textContent = SYNC_WORDS[state];
    part(this.root, "sign-in").hidden = state !== "signed-out";
  }

  private split(): void {
    const { root } = this;
    const stage = part(root, "stage");
    new Splitter({ bar: part(root, "splitter-x"), frame: stage, property: "--image-share", axis: "x", share: 0.56, least: 0.2, most: 0.8, storageKey: "quaymark.register.split-x" });
    new Splitter({ bar: part(root, "splitter-y"), frame: root, property: "--stage-share", axis: "y", share: 0.6, least: 0.3, most: 0.8, storageKey: "quaymark.register.split-y" });
  }
}

function actionOfButton(name: string): Action | null {
  switch (name) {
    case "image-previous":
      return { kind: "image", by: -1 };
    case "image-next":
      return { kind: "image", by: 1 };
    case "undo":
    case "redo":
    case "save":
    case "register":
    case "layers":
    case "map":
    case "import":
    case "help":
      return { kind: name };
    default:
      return null;
  }
}

/** What was said of the last attempt no longer holds. */
function clearFlashes(): void {
  document.querySelector("[data-flashes]")?.replaceChildren();
}

function tilesOf(root: HTMLElement): { url: string; attribution: string } | null {
  const url = root.dataset["tileUrl"] ?? "";
  return url === "" ? null : { url, attribution: root.dataset["tileAttribution"] ?? "" };
}

function dialog(id: string): HTMLDialogElement {
  const found = document.getElementById(id);
  if (!(found instanceof HTMLDialogElement)) {
    throw new Error(`The template lacks the dialog ${id}.`);
  }
  return found;
}
