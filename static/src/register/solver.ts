/**
 * Keeps the figures true: at once by the browser's own solver, and at rest by the server, which
 * also decides who agrees and says what else there is to say.
 *
 * The browser starts from the server's last camera and keeps its decisions. Moving a pixel, or
 * taking a point out, needs no more; a point that the server has not judged yet waits for it.
 */
import type { Camera, Pixel } from "../geometry/camera";
import { solveLive, type Terms } from "../geometry/live-solution";
import { ApiProblem } from "../api";
import { intrinsicsFrom, type MethodPoint, type RegistrationApi, type SolveAnswer } from "./api";
import type { Editor, Figures } from "./editor";
import type { Errors } from "./model/order";
import type { CompletePoint } from "./model/point";

const REST_MS = 180;
const RETRY_MS = 4000;

interface Ground {
  readonly camera: Camera;
  readonly terms: Omit<Terms, "used">;
  /** By key, what the server decided of each point of role control. */
  readonly isUsed: ReadonlyMap<string, boolean>;
}

export type SolverState = "solving" | "solved" | "unreachable" | "failed";

export class Solver {
  /** Time of the last solve in this browser, ms: shown nowhere, read by whoever measures. */
  lastSolveMs = 0;
  private ground: Ground | null = null;
  private timer = 0;
  private edits = 0;
  private asked: AbortController | null = null;

  constructor(
    private readonly editor: Editor,
    private readonly api: RegistrationApi,
    private readonly onState: (state: SolverState, message: string) => void,
  ) {
    editor.listen((changes) => {
      if (changes.has("points")) {
        this.edits += 1;
        this.onState("solving", "");
        this.solveHere();
        this.askSoon(REST_MS);
      }
    });
  }

  askSoon(delayMs: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      if (this.editor.isDragging) {
        this.askSoon(REST_MS);
      } else {
        void this.ask();
      }
    }, delayMs);
  }

  private async ask(): Promise<void> {
    this.asked?.abort();
    const control = new AbortController();
    this.asked = control;
    this.onState("solving", "");
    const points = this.editor.complete;
    const { edits } = this;
    try {
      const answer = await this.api.solve(points, control.signal);
      if (!control.signal.aborted) {
        this.take(answer, points);
        this.onState(edits === this.edits ? "solved" : "solving", "");
      }
    } catch (error) {
      if (control.signal.aborted) {
        return;
      }
      if (error instanceof ApiProblem) {
        this.onState("failed", error.message);
      } else {
        this.onState("unreachable", "The server cannot be reached; figures come from this browser alone.");
        this.askSoon(RETRY_MS);
      }
    }
  }

  private take(answer: SolveAnswer, points: readonly CompletePoint[]): void {
    const { editor } = this;
    editor.answer = answer;
    this.ground = groundOf(answer);
    const pnp = answer.methods.find(({ method }) => method === "pnp");
    const isCurrent = points.every((point) => editor.points.includes(point));
    if (this.ground === null || pnp?.error !== null) {
      editor.figures = null;
    } else if (isCurrent) {
      editor.figures = figuresOf(this.ground.camera, pnp.points);
    } else {
      this.solveHere();
    }
    editor.tell("answer", "figures");
  }

  /** The fit of this frame; without the server's first camera there is none. */
  private solveHere(): void {
    const { ground, editor } = this;
    const control = editor.complete.filter(({ role }) => role === "control");
    const known = control.filter(({ key }) => ground?.isUsed.has(key) === true);
    const used = known.map(({ key }) => ground?.isUsed.get(key) === true);
    if (ground === null || used.filter(Boolean).length < LEAST_POINTS) {
      editor.figures = null;
      editor.tell("figures");
      return;
    }
    const begun = performance.now();
    const judged = [...known, ...editor.complete.filter((point) => !known.includes(point))];
    const sightings = judged.map(({ place, pixel }) => ({
      point: editor.world.frame.position(place),
      pixel,
    }));
    const solution = solveLive(ground.camera, sightings, { ...ground.terms, used });
    this.ground = { ...ground, camera: solution.camera };
    const residualsPx = new Map<string, Pixel>();
    const errors = new Map<string, Errors>();
    const outliers = new Set<string>();
    judged.forEach((point, index) => {
      const off = solution.residualsPx[index] ?? null;
      if (off !== null) {
        residualsPx.set(point.key, off);
      }
      errors.set(point.key, {
        errorPx: off === null ? null : Math.hypot(off[0], off[1]),
        leaveOneOutPx: point.role === "control" ? (solution.leaveOneOutPx[index] ?? null) : null,
      });
      if (index < known.length && used[index] !== true) {
        outliers.add(point.key);
      }
    });
    editor.figures = { camera: solution.camera, residualsPx, errors, outliers };
    this.lastSolveMs = performance.now() - begun;
    editor.tell("figures");
  }
}

const LEAST_POINTS = 6;

function groundOf(answer: SolveAnswer): Ground | null {
  const { camera } = answer;
  const pnp = answer.methods.find(({ method }) => method === "pnp");
  if (camera === null || pnp === undefined) {
    return null;
  }
  return {
    camera: {
      intrinsics: intrinsicsFrom(camera.intrinsics),
      camFromWorld: camera.R_cam_from_enu,
      center: camera.center_enu_m,
    },
    terms: {
      refinedFrom: camera.refined_from === null ? null : intrinsicsFrom(camera.refined_from),
      priors: { pixelPx: camera.priors.pixel_px, focal: camera.priors.focal, k1: camera.priors.k1 },
    },
    isUsed: new Map(
      pnp.points
        .filter(({ leave_one_out_px }) => leave_one_out_px !== null)
        .map(({ key, is_used }) => [key, is_used]),
    ),
  };
}

function figuresOf(camera: Camera, points: readonly MethodPoint[]): Figures {
  const residualsPx = new Map<string, Pixel>();
  const errors = new Map<string, Errors>();
  const outliers = new Set<string>();
  for (const point of points) {
    if (point.du_px !== null && point.dv_px !== null) {
      residualsPx.set(point.key, [point.du_px, point.dv_px]);
    }
    errors.set(point.key, { errorPx: point.error_px, leaveOneOutPx: point.leave_one_out_px });
    if (!point.is_used && point.leave_one_out_px !== null) {
      outliers.add(point.key);
    }
  }
  return { camera, residualsPx, errors, outliers };
}
