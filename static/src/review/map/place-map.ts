/**
 * A small map beside the photograph, drawn here so that it needs no tiles: the camera with what it
 * looks at, the vessel's way before and after the image, and its box on the water.
 */
import { number } from "../../format";
import { correctionOf } from "../correction";
import type { Pose } from "../pose";
import type { RunCamera } from "../surroundings";
import { ellipseOf, outlineOf } from "./ellipse";
import { frameOf, metresFrom, roundLengthM, type MapFrame, type Metres } from "./map-frame";
import { cutAt, type TrackPoint } from "./track";

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 320;
const HEIGHT = 190;
const RADIANS = Math.PI / 180;
/** A footprint is never drawn shorter than this, so that a tug 3 km away is still seen. */
const LEAST_SHIP_PX = 14;
const SCALE_BAR_PX = 80;
/** Radius that holds 95 % of a normal distribution in two dimensions. */
const SIGMAS_OF_95 = 2.448;

export interface OnMap {
  readonly camera: RunCamera;
  readonly pose: Pose;
  readonly track: readonly TrackPoint[];
  readonly at: string;
}

export function drawMap({ camera, pose, track, at }: OnMap): SVGSVGElement {
  const svg = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "place-map", role: "img" });
  const vessel = vesselOf(camera, pose);
  const { before, after } = cutAt(track, at);
  const inMetres = (points: readonly TrackPoint[]): Metres[] =>
    points.map(({ latDeg, lonDeg }) => metresFrom(camera, latDeg, lonDeg));
  const [been, going] = [inMetres(before), inMetres(after)];
  const frame = frameOf([[0, 0], vessel.at, ...near([...been, ...going], vessel.at)], WIDTH, HEIGHT);
  const { looking, half } = viewOf(camera);
  svg.setAttribute("aria-label", inWords(vessel.at));
  svg.append(
    path("place-map__view", cone(frame, looking, half)),
    path("place-map__track", line(frame, [...been, vessel.at])),
    path("place-map__track is-later", line(frame, [vessel.at, ...going])),
    path("place-map__doubt", doubt(frame, pose, vessel.at)),
    path("place-map__ship", footprint(frame, vessel)),
    path("place-map__camera", cameraMark(frame, looking)),
    ...scaleBar(frame),
    ...north(),
  );
  return svg;
}

interface Vessel {
  readonly at: Metres;
  readonly headingDeg: number;
  readonly lengthM: number;
  readonly widthM: number;
}

function vesselOf(camera: RunCamera, pose: Pose): Vessel {
  const byHand = correctionOf(pose);
  const { lat_deg: lat, lon_deg: lon } = byHand ?? pose.position;
  return {
    at: metresFrom(camera, lat, lon),
    headingDeg: (byHand ?? pose).heading_deg,
    lengthM: (byHand ?? pose).length_m,
    widthM: (byHand ?? pose).width_m,
  };
}

/** A fast ferry's six minutes would shrink everything else: its far ends run out of the map. */
function near(points: readonly Metres[], vessel: Metres): readonly Metres[] {
  const reach = Math.max(250, Math.hypot(...vessel));
  return points.filter(([x, y]) => Math.hypot(x - vessel[0], y - vessel[1]) <= reach);
}

/** Where the camera looks and half of how wide, degrees. */
function viewOf(camera: RunCamera): { readonly looking: number; readonly half: number } {
  const [east = 0, north = 1] = camera.R_cam_from_enu[2] ?? [];
  return {
    looking: Math.atan2(east, north) / RADIANS,
    half: Math.atan(camera.width_px / 2 / camera.fx_px) / RADIANS,
  };
}

function cone(frame: MapFrame, lookingDeg: number, halfDeg: number): string {
  const reach = (frame.width + frame.height) / frame.pxPerM;
  const end = (degrees: number): Metres => [
    reach * Math.sin(degrees * RADIANS),
    reach * Math.cos(degrees * RADIANS),
  ];
  return `${line(frame, [end(lookingDeg - halfDeg), [0, 0], end(lookingDeg + halfDeg)])}Z`;
}

/** A hull seen from above, its bow pointed. */
function footprint(frame: MapFrame, { at, headingDeg, lengthM, widthM }: Vessel): string {
  const grown = Math.max(1, LEAST_SHIP_PX / (lengthM * frame.pxPerM));
  const leastBeam = LEAST_SHIP_PX / 6 / frame.pxPerM;
  const [half, beam] = [(lengthM * grown) / 2, Math.max(leastBeam, (widthM * grown) / 2)];
  const [s, c] = [Math.sin(headingDeg * RADIANS), Math.cos(headingDeg * RADIANS)];
  const point = (forward: number, starboard: number): Metres => [
    at[0] + forward * s + starboard * c,
    at[1] + forward * c - starboard * s,
  ];
  const shoulder = half * 0.55;
  return `${line(frame, [
    point(half, 0),
    point(shoulder, beam),
    point(-half, beam),
    point(-half, -beam),
    point(shoulder, -beam),
  ])}Z`;
}

/** Where the vessel's middle is with 95 % probability; a place set by hand has no such ellipse. */
function doubt(frame: MapFrame, pose: Pose, at: Metres): string {
  const ellipse = correctionOf(pose) === null ? ellipseOf(pose) : null;
  return ellipse === null ? "" : `${line(frame, outlineOf(ellipse, at, SIGMAS_OF_95))}Z`;
}

function cameraMark(frame: MapFrame, lookingDeg: number): string {
  const [x, y] = frame.at([0, 0]);
  const corner = (turn: number, size: number): string => {
    const angle = (lookingDeg + turn) * RADIANS;
    return `${(x + size * Math.sin(angle)).toFixed(1)} ${(y - size * Math.cos(angle)).toFixed(1)}`;
  };
  return `M${corner(0, 9)}L${corner(140, 7)}L${corner(220, 7)}Z`;
}

function scaleBar(frame: MapFrame): SVGElement[] {
  const metres = roundLengthM(SCALE_BAR_PX / frame.pxPerM);
  const length = metres * frame.pxPerM;
  const y = HEIGHT - 9;
  const words = metres >= 1000 ? `${number(metres / 1000)} km` : `${number(metres)} m`;
  return [
    path("place-map__scale", `M9 ${y - 4}V${y}H${(9 + length).toFixed(1)}V${y - 4}`),
    text(14 + length, y, words),
  ];
}

function north(): SVGElement[] {
  const x = WIDTH - 14;
  return [path("place-map__north", `M${x} 22V9l-4 6m4-6 4 6`), text(x - 4.5, 36, "N")];
}

function inWords([east, north]: Metres): string {
  const bearing = (Math.atan2(east, north) / RADIANS + 360) % 360;
  return `Map: the vessel ${number(Math.hypot(east, north))} m from the camera, bearing ${number(bearing)} degrees`;
}

function line(frame: MapFrame, points: readonly Metres[]): string {
  return points.length < 2
    ? ""
    : `M${points.map((point) => frame.at(point).map((value) => value.toFixed(1)).join(" ")).join("L")}`;
}

function path(className: string, d: string): SVGElement {
  return make("path", { class: className, d });
}

function text(x: number, y: number, words: string): SVGElement {
  const made = make("text", { class: "place-map__text", x: x.toFixed(1), y: String(y) });
  made.textContent = words;
  return made;
}

function make<Name extends "svg" | "path" | "text">(
  name: Name,
  attributes: Readonly<Record<string, string>>,
): SVGElementTagNameMap[Name] {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) {
    made.setAttribute(key, value);
  }
  return made;
}
