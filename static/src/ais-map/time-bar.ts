/** The controls of the clock: play and pause, slider over a day, day, speed, window; and their keys. */
import { part } from "../page/parts";
import { DAY_S, type Clock } from "./clock";

const STEP_S = 60;
const LONG_STEP_S = 600;

export class TimeBar {
  private readonly slider: HTMLInputElement;
  private readonly day: HTMLInputElement;
  private readonly speed: HTMLSelectElement;
  private readonly span: HTMLSelectElement;
  private readonly play: HTMLElement;
  private readonly moment: HTMLElement;
  private readonly local: HTMLElement;
  private readonly localClock: Intl.DateTimeFormat;

  constructor(
    root: HTMLElement,
    private readonly clock: Clock,
    timeZone: string,
  ) {
    this.slider = part(root, "slider") as HTMLInputElement;
    this.day = part(root, "day") as HTMLInputElement;
    this.speed = part(root, "speed") as HTMLSelectElement;
    this.span = part(root, "window") as HTMLSelectElement;
    this.play = part(root, "play");
    this.moment = part(root, "moment");
    this.local = part(root, "local");
    this.localClock = new Intl.DateTimeFormat("en-GB", { timeZone, timeStyle: "long" });
    this.slider.addEventListener("input", () => {
      clock.set(clock.dayStartS + Number(this.slider.value));
    });
    this.day.addEventListener("change", () => {
      const start = Date.parse(`${this.day.value}T00:00:00Z`) / 1000;
      if (!Number.isNaN(start)) {
        clock.set(start + (clock.momentS - clock.dayStartS));
      }
    });
    this.speed.addEventListener("change", () => {
      clock.speed = Number(this.speed.value);
    });
    this.span.addEventListener("change", () => {
      clock.setWindow(Number(this.span.value));
    });
    root.addEventListener("click", ({ target }) => {
      this.act((target as HTMLElement).closest<HTMLElement>("[data-act]")?.dataset["act"] ?? "");
    });
    document.addEventListener("keydown", (event) => {
      this.press(event);
    });
    clock.speed = Number(this.speed.value);
    this.pickWindow(clock.windowS);
  }

  show(): void {
    const { clock } = this;
    const iso = new Date(clock.momentS * 1000).toISOString();
    this.moment.textContent = `${iso.slice(0, 10)} ${iso.slice(11, 19)}\u00a0UTC`;
    this.local.textContent = this.localClock.format(clock.momentS * 1000);
    const second = String(Math.round(clock.momentS - clock.dayStartS));
    if (this.slider.value !== second) {
      this.slider.value = second;
    }
    this.slider.setAttribute("aria-valuetext", `${iso.slice(11, 19)} UTC`);
    const day = iso.slice(0, 10);
    if (this.day.value !== day) {
      this.day.value = day;
    }
    this.play.textContent = clock.isPlaying ? "Pause" : "Play";
    this.play.setAttribute("aria-pressed", String(clock.isPlaying));
  }

  /** A window that a link asked for and the list does not hold is added to it. */
  private pickWindow(windowS: number): void {
    const value = String(windowS);
    if (![...this.span.options].some((option) => option.value === value)) {
      this.span.add(new Option(`${Math.round(windowS / 60)} min`, value));
    }
    this.span.value = value;
  }

  private act(name: string): void {
    const { clock } = this;
    if (name === "play") {
      clock.toggle();
      this.show();
    } else if (name === "day-before") {
      clock.step(-DAY_S);
    } else if (name === "day-after") {
      clock.step(DAY_S);
    }
  }

  private press(event: KeyboardEvent): void {
    const { target } = event;
    const isElsewhere =
      event.ctrlKey || event.altKey || event.metaKey ||
      (target instanceof HTMLElement && target.closest("input, select, textarea, button, a, .leaflet-container") !== null);
    if (event.code === "KeyP" && !event.ctrlKey && !event.altKey && !event.metaKey && !isTyping(target)) {
      this.act("play");
    } else if (isElsewhere) {
      return;
    } else if (event.code === "Space") {
      this.act("play");
      event.preventDefault();
    } else if (event.code === "ArrowLeft" || event.code === "ArrowRight") {
      const step = event.shiftKey ? LONG_STEP_S : STEP_S;
      this.clock.step(event.code === "ArrowLeft" ? -step : step);
      event.preventDefault();
    }
  }
}

function isTyping(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && target.closest("input:not([type=range]), select, textarea") !== null;
}
