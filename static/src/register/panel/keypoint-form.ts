/**
 * The selected keypoint: its name, role and pixel, and the place of its landmark, typed in decimal
 * degrees or degrees, minutes and seconds, with a height whose datum is said.
 *
 * What is typed is taken when its field is left; what is wrong stays as typed, with the reason.
 */
import { part } from "../../page/parts";
import type { Editor } from "../editor";
import { writeAngle, writeDms } from "../model/coordinates";
import { checkPlace, type Datum } from "../model/place-entry";
import { samePlace, type Point, type Role } from "../model/point";
import { FormField } from "./form-field";
import { checkName, checkPixel } from "./typed-values";

export class KeypointForm {
  private readonly name: FormField;
  private readonly u: FormField;
  private readonly v: FormField;
  private readonly lat: FormField;
  private readonly lon: FormField;
  private readonly height: FormField;
  private readonly datum: HTMLSelectElement;
  private readonly exchange: HTMLElement;
  private shownKey: string | null = null;

  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
  ) {
    this.name = new FormField(root, "name", () => {
      this.takeName();
    });
    this.u = new FormField(root, "u", () => {
      this.takePixel();
    });
    this.v = new FormField(root, "v", () => {
      this.takePixel();
    });
    const takePlace = (): void => {
      this.takePlace();
    };
    this.lat = new FormField(root, "lat", takePlace);
    this.lon = new FormField(root, "lon", takePlace);
    this.height = new FormField(root, "height", takePlace);
    this.datum = part(root, "datum") as HTMLSelectElement;
    this.datum.addEventListener("change", () => {
      this.show(true);
    });
    this.exchange = part(root, "exchange");
    this.exchange.addEventListener("click", () => {
      [this.lat.input.value, this.lon.input.value] = [this.lon.value, this.lat.value];
      this.takePlace();
    });
    for (const radio of root.querySelectorAll<HTMLInputElement>("input[name=role]")) {
      radio.addEventListener("change", () => {
        this.editor.setRole(this.editor.selectedKey ?? "", radio.value as Role);
      });
    }
    part(root, "remove").addEventListener("click", () => {
      this.editor.remove(this.editor.selectedKey ?? "");
    });
    editor.listen((changes) => {
      if (changes.has("points") || changes.has("selection") || changes.has("landmarks")) {
        this.show(false);
      }
    });
    this.show(true);
  }

  focusPlace(): void {
    this.lat.input.focus();
  }

  focusHeight(): void {
    this.height.input.focus();
    this.height.input.select();
  }

  focusName(): void {
    this.name.input.focus();
    this.name.input.select();
  }

  private show(isForced: boolean): void {
    const point = this.editor.selected;
    const isNew = point?.key !== this.shownKey || isForced;
    this.shownKey = point?.key ?? null;
    part(this.root, "keypoint-none").hidden = point !== null;
    part(this.root, "keypoint-form").hidden = point === null;
    if (point === null) {
      this.showHint();
      return;
    }
    this.name.fill(point.name, isNew);
    this.u.fill(point.pixel === null ? "" : point.pixel[0].toFixed(2), isNew);
    this.v.fill(point.pixel === null ? "" : point.pixel[1].toFixed(2), isNew);
    this.lat.fill(point.place === null ? "" : writeAngle(point.place.latDeg), isNew);
    this.lon.fill(point.place === null ? "" : writeAngle(point.place.lonDeg), isNew);
    this.height.fill(point.place === null ? "" : this.heightText(point.place.heightM), isNew);
    if (isNew) {
      this.exchange.hidden = true;
    }
    for (const radio of this.root.querySelectorAll<HTMLInputElement>("input[name=role]")) {
      radio.checked = radio.value === point.role;
    }
    this.showNotes(point);
  }

  private showHint(): void {
    const { armed } = this.editor;
    part(this.root, "keypoint-hint").textContent =
      armed === null
        ? "Click the photograph where a landmark is seen, or pick a landmark first and then click where you see it."
        : `Now click the photograph where you see ${armed.name}. Escape leaves it.`;
  }

  private showNotes(point: Point): void {
    const { place, landmarkId } = point;
    const dms = place === null ? "" : `${writeDms(place.latDeg, "lat")}, ${writeDms(place.lonDeg, "lon")}`;
    part(this.root, "dms").textContent = dms;
    part(this.root, "height-note").textContent = place === null ? "" : this.heightNote(place.heightM);
    part(this.root, "place-ways").hidden = place !== null;
    const landmark = this.editor.landmarks.find(({ id }) => id === landmarkId);
    const others = (landmark?.viewportCount ?? 0) - (this.editor.saved.some((saved) => saved.landmarkId === landmarkId) ? 1 : 0);
    const note = part(this.root, "shared-note");
    note.hidden = others <= 0;
    note.textContent = `Shared with ${others} other viewport${others === 1 ? "" : "s"}: a new name or place holds there too.`;
  }

  private heightText(heightM: number): string {
    const shown = this.datum.value === "water" ? heightM - this.editor.world.waterLevelM : heightM;
    return String(Number(shown.toFixed(3)));
  }

  private heightNote(heightM: number): string {
    const { waterLevelM } = this.editor.world;
    const above = heightM - waterLevelM;
    const side = above < 0 ? "below" : "above";
    return `${heightM.toFixed(2)} m above the ellipsoid, ${Math.abs(above).toFixed(2)} m ${side} the water (at ${waterLevelM.toFixed(2)} m).`;
  }

  private takeName(): void {
    const point = this.editor.selected;
    if (point === null || this.name.value.trim() === point.name) {
      this.name.say(null);
      return;
    }
    const typed = this.name.value.trim();
    const landmark = this.editor.landmarks.find(({ name }) => name === typed);
    if (landmark !== undefined && point.place === null) {
      this.name.say(null);
      this.editor.pick(landmark);
      return;
    }
    const name = checkName(typed, point, this.editor);
    this.name.say(name.error ?? null);
    if (name.error === undefined) {
      this.editor.change(point.key, { name: name.value }, `rename ${point.name}`);
    }
  }

  private takePixel(): void {
    const point = this.editor.selected;
    if (point === null || (this.u.value === "" && this.v.value === "" && point.pixel === null)) {
      return;
    }
    const [u, v] = [checkPixel(this.u.value, "u", this.editor), checkPixel(this.v.value, "v", this.editor)];
    this.u.say(u.error ?? null);
    this.v.say(v.error ?? null);
    if (u.error !== undefined || v.error !== undefined) {
      return;
    }
    const isSame = this.u.value === point.pixel?.[0].toFixed(2) && this.v.value === point.pixel[1].toFixed(2);
    if (!isSame) {
      this.editor.movePixel(point.key, [u.value, v.value], null);
    }
  }

  /** The three fields are one value: nothing is taken until all of them are there and right. */
  private takePlace(): void {
    const point = this.editor.selected;
    if (point === null || this.isPlaceAsShown(point)) {
      return;
    }
    const typed = {
      lat: this.lat.value,
      lon: this.lon.value,
      height: this.height.value,
      datum: this.datum.value as Datum,
    };
    const { frame, waterLevelM } = this.editor.world;
    const checked = checkPlace(typed, frame, waterLevelM);
    const errors = checked.errors ?? {};
    // A field that is still empty is no mistake yet, while the others are being typed.
    const isPartial = [typed.lat, typed.lon, typed.height].some((text) => text.trim() === "");
    const shown = (text: string, error: string | undefined): string | null =>
      error === undefined || (isPartial && text.trim() === "" && point.place === null) ? null : error;
    this.lat.say(shown(typed.lat, errors.lat));
    this.lon.say(shown(typed.lon, errors.lon));
    this.height.say(shown(typed.height, errors.height));
    this.exchange.hidden = errors.isExchanged !== true;
    if (checked.errors === undefined && !samePlace(checked.place, point.place)) {
      this.editor.change(point.key, { place: checked.place }, `locate ${point.name}`);
      this.show(true);
    }
  }

  /** Fields show rounded figures: leaving one without typing must not round the place. */
  private isPlaceAsShown({ place }: Point): boolean {
    const isShown =
      place !== null &&
      this.lat.value === writeAngle(place.latDeg) &&
      this.lon.value === writeAngle(place.lonDeg) &&
      this.height.value === this.heightText(place.heightM);
    if (isShown) {
      for (const field of [this.lat, this.lon, this.height]) {
        field.say(null);
      }
      this.exchange.hidden = true;
    }
    return isShown;
  }
}
