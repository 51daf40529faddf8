/**
 * Undo and redo: the states before and after, whole.
 *
 * A list of forty points is small and its parts are shared, so keeping it whole is simpler and
 * safer than inverting each edit. Edits with the same `stroke` (one drag, say) are one step.
 */

export interface Step<State> {
  readonly state: State;
  /** What the edit that led away from the state did, to be named on the button. */
  readonly label: string;
}

const MOST_STEPS = 500;

export class History<State> {
  private readonly past: Step<State>[] = [];
  private future: Step<State>[] = [];
  private stroke: string | null = null;

  constructor(private now: State) {}

  get state(): State {
    return this.now;
  }

  get undoLabel(): string | null {
    return this.past.at(-1)?.label ?? null;
  }

  get redoLabel(): string | null {
    return this.future.at(-1)?.label ?? null;
  }

  edit(state: State, label: string, stroke: string | null = null): void {
    const continues = stroke !== null && stroke === this.stroke && this.past.length > 0;
    if (!continues) {
      this.past.push({ state: this.now, label });
      if (this.past.length > MOST_STEPS) {
        this.past.shift();
      }
    }
    this.stroke = stroke;
    this.future = [];
    this.now = state;
  }

  undo(): boolean {
    return this.travel(this.past, this.future);
  }

  redo(): boolean {
    return this.travel(this.future, this.past);
  }

  /** Changes what is known of the present state (ids given by a save) without a step of its own. */
  amend(change: (state: State) => State): void {
    this.now = change(this.now);
    const all = [this.past, this.future];
    for (const steps of all) {
      steps.forEach((step, index) => {
        steps[index] = { ...step, state: change(step.state) };
      });
    }
  }

  private travel(from: Step<State>[], to: Step<State>[]): boolean {
    const step = from.pop();
    this.stroke = null;
    if (step === undefined) {
      return false;
    }
    to.push({ state: this.now, label: step.label });
    this.now = step.state;
    return true;
  }
}
