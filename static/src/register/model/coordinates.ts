/**
 * Typed coordinates: decimal degrees or degrees, minutes and seconds, with or without hemispheres.
 *
 * "53.541", "53,541 N", "N 53 32 27.6", "53°32'27.6\"N", "53d 32.46m" are all understood; a pair in
 * one field is taken apart. What cannot be meant is refused with the reason: minutes of 75, an east
 * in a latitude, a minus sign with a hemisphere.
 */

export type Axis = "lat" | "lon";

export type Parsed<Value> =
  | { readonly value: Value; readonly error?: undefined }
  | { readonly error: string };

const NAMES = { lat: "latitude", lon: "longitude" } as const;
const LIMITS = { lat: 90, lon: 180 } as const;
const HEMISPHERES = { lat: "NS", lon: "EW" } as const;
const EXAMPLES = { lat: "53.5410 or 53 32 27.6 N", lon: "9.9801 or 9 58 48.4 E" } as const;

export function parseAngle(text: string, axis: Axis): Parsed<number> {
  const name = NAMES[axis];
  const trimmed = text.trim().toUpperCase();
  if (trimmed === "") {
    return { error: `Give the ${name}, for example ${EXAMPLES[axis]}.` };
  }
  const letters = trimmed.match(/[NSEWO](?![A-Z])/g) ?? [];
  const rest = trimmed.replace(/[NSEWO](?![A-Z])/g, " ");
  if (/[A-CE-LN-RT-Z]/.test(rest)) {
    return { error: `The ${name} “${text.trim()}” is no coordinate; write ${EXAMPLES[axis]}.` };
  }
  if (letters.length > 1) {
    return { error: `The ${name} names ${letters.length} hemispheres (${letters.join(", ")}); keep one.` };
  }
  const letter = letters[0] === "O" ? "E" : letters[0];
  if (letter !== undefined && !HEMISPHERES[axis].includes(letter)) {
    const [a, b] = HEMISPHERES[axis];
    return { error: `A ${name} is ${a ?? ""} or ${b ?? ""}, not ${letter}: are latitude and longitude exchanged?` };
  }
  const parts = rest.replace(/,/g, ".").match(/[+-]?\d+(?:\.\d*)?|[+-]?\.\d+/g) ?? [];
  const leftover = rest.replace(/,/g, ".").replace(/[\d.+\-\s°º˚'’′"”″:DMS]/g, "");
  if (parts.length === 0 || parts.length > 3 || leftover !== "") {
    return { error: `The ${name} “${text.trim()}” is no coordinate; write ${EXAMPLES[axis]}.` };
  }
  return combine(parts, letter, axis);
}

function combine(parts: readonly string[], letter: string | undefined, axis: Axis): Parsed<number> {
  const name = NAMES[axis];
  const [degrees = 0, minutes = 0, seconds = 0] = parts.map(Number);
  const isNegative = (parts[0] ?? "").startsWith("-");
  if (isNegative && letter !== undefined) {
    return { error: `The ${name} has both a minus sign and ${letter}; keep one of them.` };
  }
  const broken = parts.slice(0, -1).some((part) => !Number.isInteger(Number(part)));
  if (broken) {
    return { error: `Only the last part of the ${name} may have decimals: ${EXAMPLES[axis]}.` };
  }
  if (parts.slice(1).some((part) => part.startsWith("-"))) {
    return { error: `Only the degrees of the ${name} may carry a minus sign.` };
  }
  if (minutes >= 60) {
    return { error: `${parts[1] ?? ""} minutes are too many: minutes of the ${name} run from 0 to below 60.` };
  }
  if (seconds >= 60) {
    return { error: `${parts[2] ?? ""} seconds are too many: seconds of the ${name} run from 0 to below 60.` };
  }
  const size = Math.abs(degrees) + minutes / 60 + seconds / 3600;
  if (size > LIMITS[axis]) {
    return { error: `A ${name} lies between −${LIMITS[axis]} and ${LIMITS[axis]}, not ${Number(size.toFixed(4))}.` };
  }
  return { value: isNegative || letter === "S" || letter === "W" ? -size : size };
}

/**
 * Takes a pair in one field apart ("53.541, 9.9801" or "53 32 27 N 9 58 48 E"); null when the text
 * holds one coordinate only.
 */
export function splitPair(text: string): readonly [lat: string, lon: string] | null {
  const trimmed = text.trim();
  const lettered = /^(.*?[NS])[\s,;]*(.*[EWO])$/i.exec(trimmed) ?? /^([NS].*?)[\s,;]*([EWO].*)$/i.exec(trimmed);
  if (lettered?.[1] !== undefined && lettered[2] !== undefined) {
    return [lettered[1], lettered[2]];
  }
  const halves = /^([+-]?\d+\.\d+)\s*[,;\s]\s*([+-]?\d+\.\d+)$/.exec(trimmed) ?? /^([^;]+);([^;]+)$/.exec(trimmed);
  return halves?.[1] !== undefined && halves[2] !== undefined ? [halves[1], halves[2]] : null;
}

/** A number as people type it; a decimal comma counts. */
export function parseNumber(text: string, what: string): Parsed<number> {
  const trimmed = text.trim().replace("−", "-");
  if (trimmed === "") {
    return { error: `Give ${what}.` };
  }
  const value = /^[+-]?(\d+([.,]\d*)?|[.,]\d+)$/.test(trimmed)
    ? Number(trimmed.replace(",", "."))
    : Number.NaN;
  return Number.isFinite(value) ? { value } : { error: `“${text.trim()}” is no number; give ${what}.` };
}

/** Seven decimals are a centimetre. */
export function writeAngle(degrees: number): string {
  return degrees.toFixed(7);
}

/** As surveyors write it: 53° 32′ 27.600″ N. */
export function writeDms(degrees: number, axis: Axis): string {
  const letter = HEMISPHERES[axis][degrees < 0 ? 1 : 0] ?? "";
  const thousandths = Math.round(Math.abs(degrees) * 3_600_000);
  const seconds = ((thousandths % 60_000) / 1000).toFixed(3).padStart(6, "0");
  const minutes = String(Math.floor(thousandths / 60_000) % 60).padStart(2, "0");
  return `${Math.floor(thousandths / 3_600_000)}° ${minutes}′ ${seconds}″ ${letter}`;
}
