/**
 * The modes of the review page: at any moment exactly one holds, and only its keys count.
 *
 * A mode brings its own commands, so that one table tells what every key does: the page's help, a
 * person's own key bindings and the keyboard all read it. Keys are places on the keyboard
 * (`event.code`). A banner over the photograph names every mode but the usual one.
 */
import { part } from "../page/parts";

export const MODE_NAMES = ["review", "reasons", "edit", "rematch", "missed"] as const;
export type ModeName = (typeof MODE_NAMES)[number];

/** How a command takes Shift: it must be up, must be down, or makes the same step a fine one. */
export type ShiftUse = "without" | "with" | "fine";

export interface Command {
  /** Stable, because people's own key bindings are kept under it: "edit.turn-left". */
  readonly id: string;
  /** Places on the keyboard at first, as `event.code`; a person may change them. */
  readonly codes: readonly string[];
  readonly shift?: ShiftUse;
  /** A key held down repeats it. */
  readonly repeats?: boolean;
  /** What it does, as the help says it. */
  readonly meaning: string;
}

export interface Press {
  readonly fine: boolean;
}

export interface Mode {
  readonly name: ModeName;
  /** What the banner says: the mode's name and what to do in it; empty for no banner. */
  readonly title: string;
  readonly hint: string;
  readonly commands: readonly Command[];
  /** A key that is not the mode's own leaves it and counts in the usual mode. */
  readonly fallsThrough?: boolean;
  /** Begins; false when there is nothing to do here, and the mode before goes on. */
  enter(): boolean;
  leave(): void;
  act(commandId: string, press: Press): void;
}

type Listener = (mode: Mode) => void;

export class ModeMachine {
  private readonly modes = new Map<ModeName, Mode>();
  private readonly listeners: Listener[] = [];
  private now: Mode;

  /** `usual` is the mode to which every other one returns. */
  constructor(readonly usual: Mode) {
    this.now = usual;
    this.add(usual);
  }

  get current(): Mode {
    return this.now;
  }

  /** All modes in the order of their names, for tables of keys. */
  get all(): readonly Mode[] {
    return MODE_NAMES.flatMap((name) => this.modes.get(name) ?? []);
  }

  add(mode: Mode): void {
    this.modes.set(mode.name, mode);
  }

  onChange(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** Leaves the mode that holds and begins another; false when that one refuses. */
  enter(name: ModeName): boolean {
    const next = this.modes.get(name);
    if (next === undefined || next === this.now) {
      return next !== undefined;
    }
    this.leave();
    if (next !== this.usual && !next.enter()) {
      return false;
    }
    this.now = next;
    this.tell();
    return true;
  }

  /** Back to the usual mode. */
  leave(): void {
    if (this.now === this.usual) {
      return;
    }
    const left = this.now;
    this.now = this.usual; // first, so that a mode's own cleaning up finds itself left
    left.leave();
    this.tell();
  }

  private tell(): void {
    for (const listener of this.listeners) {
      listener(this.now);
    }
  }
}

/** Names the mode over the photograph and on the page, for the eye, the ear and the stylesheet. */
export function showModes(root: HTMLElement, machine: ModeMachine): void {
  const banner = part(root, "mode");
  const show = (mode: Mode): void => {
    root.dataset["mode"] = mode.name;
    banner.hidden = mode.title === "";
    part(banner, "mode-title").textContent = mode.title;
    part(banner, "mode-hint").textContent = mode.hint;
  };
  machine.onChange(show);
  show(machine.current);
}
