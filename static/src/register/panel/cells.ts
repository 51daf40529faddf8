/** The columns of the keypoint table: what each shows, and how a typed value becomes an edit. */
import { number } from "../../format";
import type { Editor } from "../editor";
import { parseNumber, writeAngle, parseAngle, type Parsed } from "../model/coordinates";
import type { Column, Errors } from "../model/order";
import { checkPlace } from "../model/place-entry";
import { ROLES, type Point, type Role } from "../model/point";
import { checkName, checkPixel } from "./typed-values";

export interface Cell {
  readonly column: Column;
  readonly title: string;
  readonly hint: string;
  readonly isNumber: boolean;
  readonly isEditable: boolean;
}

export const CELLS: readonly Cell[] = [
  { column: "name", title: "Name", hint: "The landmark", isNumber: false, isEditable: true },
  { column: "loo", title: "Leave-one-out", hint: "Pixels off if the fit had not known this keypoint: the error to trust", isNumber: true, isEditable: false },
  { column: "error", title: "Residual", hint: "Pixels between click and projection", isNumber: true, isEditable: false },
  { column: "role", title: "Role", hint: "Control enters the fit, check only judges it, off is left out", isNumber: false, isEditable: true },
  { column: "u", title: "u", hint: "Pixels from the left; 0 is the centre of the first", isNumber: true, isEditable: true },
  { column: "v", title: "v", hint: "Pixels from the top; 0 is the centre of the first", isNumber: true, isEditable: true },
  { column: "lat", title: "Latitude", hint: "WGS84, degrees", isNumber: true, isEditable: true },
  { column: "lon", title: "Longitude", hint: "WGS84, degrees", isNumber: true, isEditable: true },
  { column: "height", title: "Height", hint: "Metres above the WGS84 ellipsoid", isNumber: true, isEditable: true },
];

export function textOf(point: Point, column: Column, errors: Errors | undefined): string {
  switch (column) {
    case "name":
      return point.name;
    case "u":
      return number(point.pixel?.[0], 2);
    case "v":
      return number(point.pixel?.[1], 2);
    case "lat":
      return point.place === null ? "–" : writeAngle(point.place.latDeg);
    case "lon":
      return point.place === null ? "–" : writeAngle(point.place.lonDeg);
    case "height":
      return number(point.place?.heightM, 2);
    case "role":
      return point.role;
    case "error":
      return number(errors?.errorPx, 2);
    case "loo":
      return number(errors?.leaveOneOutPx, 2);
  }
}

/** What stands in the field when editing begins: all digits, no thousands. */
export function fieldText(point: Point, column: Column): string {
  switch (column) {
    case "name":
      return point.name;
    case "u":
      return point.pixel === null ? "" : String(Number(point.pixel[0].toFixed(3)));
    case "v":
      return point.pixel === null ? "" : String(Number(point.pixel[1].toFixed(3)));
    case "lat":
      return point.place === null ? "" : String(Number(point.place.latDeg.toFixed(9)));
    case "lon":
      return point.place === null ? "" : String(Number(point.place.lonDeg.toFixed(9)));
    case "height":
      return point.place === null ? "" : String(Number(point.place.heightM.toFixed(4)));
    default:
      return point.role;
  }
}

/** The change that a typed value means, or what is wrong with it. */
export function changeOf(point: Point, column: Column, text: string, editor: Editor): Parsed<Partial<Point>> {
  switch (column) {
    case "name": {
      const name = checkName(text, point, editor);
      return name.error === undefined ? { value: { name: name.value } } : name;
    }
    case "u":
    case "v": {
      const value = checkPixel(text, column, editor);
      if (value.error !== undefined) {
        return value;
      }
      const [u, v] = point.pixel ?? [0, 0];
      return { value: { pixel: column === "u" ? [value.value, v] : [u, value.value] } };
    }
    case "lat":
    case "lon":
    case "height":
      return placeChange(point, column, text, editor);
    case "role":
      return isRole(text) ? { value: { role: text } } : { error: `One of ${ROLES.join(", ")}.` };
    default:
      return { error: "This is computed." };
  }
}

function placeChange(
  point: Point,
  column: "lat" | "lon" | "height",
  text: string,
  editor: Editor,
): Parsed<Partial<Point>> {
  const parsed = column === "height" ? parseNumber(text, "metres above the ellipsoid") : parseAngle(text, column);
  if (parsed.error !== undefined) {
    return parsed;
  }
  if (point.place === null) {
    return { error: "Give the whole place first, in the form or on the map." };
  }
  const { latDeg, lonDeg, heightM } = point.place;
  const checked = checkPlace(
    {
      lat: column === "lat" ? text : String(latDeg),
      lon: column === "lon" ? text : String(lonDeg),
      height: column === "height" ? text : String(heightM),
      datum: "ellipsoid",
    },
    editor.world.frame,
    editor.world.waterLevelM,
  );
  if (checked.errors === undefined) {
    return { value: { place: checked.place } };
  }
  return { error: Object.values(checked.errors).find((error) => typeof error === "string") ?? "" };
}

function isRole(text: string): text is Role {
  return (ROLES as readonly string[]).includes(text);
}
