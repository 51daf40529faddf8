/** Numbers, times and places as people read them; anything unknown is an en dash. */

const DASH = "–";
const THIN_SPACE = "\u202f";
/** Between a number and its unit: they stay on one line. */
const FIXED_SPACE = "\u00a0";

function isUnknown(value: number | null | undefined): value is null | undefined {
  return value === null || value === undefined || !Number.isFinite(value);
}

/** A fixed count of decimals and thousands set apart, a true minus sign for negatives. */
export function number(value: number | null | undefined, digits = 0): string {
  if (isUnknown(value)) {
    return DASH;
  }
  const [whole = "", decimals] = Math.abs(value).toFixed(digits).split(".");
  const grouped = whole.replace(/\B(?=(\d{3})+(?!\d))/g, THIN_SPACE);
  const text = decimals === undefined ? grouped : `${grouped}.${decimals}`;
  return value < 0 && Number(text.replaceAll(THIN_SPACE, "")) !== 0 ? `−${text}` : text;
}

/** A number with its unit. */
export function quantity(value: number | null | undefined, unit: string, digits = 0): string {
  return isUnknown(value) ? DASH : `${number(value, digits)}${FIXED_SPACE}${unit}`;
}

/** How long: seconds, then minutes and seconds, then hours and minutes. */
export function duration(seconds: number | null | undefined): string {
  if (isUnknown(seconds)) {
    return DASH;
  }
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) {
    return `${whole} s`;
  }
  const minutes = Math.floor(whole / 60);
  if (minutes < 60) {
    return `${minutes} min ${String(whole % 60).padStart(2, "0")} s`;
  }
  return `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
}

/** A position in decimal degrees with its hemispheres; five decimals are about a metre. */
export function position(latDeg: number, lonDeg: number): string {
  const part = (value: number, positive: string, negative: string): string =>
    `${Math.abs(value).toFixed(5)}°${FIXED_SPACE}${value < 0 ? negative : positive}`;
  return `${part(latDeg, "N", "S")}, ${part(lonDeg, "E", "W")}`;
}

/** A heading, clockwise from north, as three digits before the point. */
export function heading(degrees: number | null | undefined): string {
  if (isUnknown(degrees)) {
    return DASH;
  }
  const tenths = Math.round((((degrees % 360) + 360) % 360) * 10) % 3600;
  return `${(tenths / 10).toFixed(1).padStart(5, "0")}°`;
}

/** An ISO moment as `2026-11-22 10:00:05 UTC`. */
export function utc(iso: string): string {
  const moment = new Date(iso);
  return Number.isNaN(moment.getTime())
    ? DASH
    : `${moment.toISOString().slice(0, 19).replace("T", " ")}${FIXED_SPACE}UTC`;
}

/** The same moment on the clocks of a zone: `11:00:05 CET`; the date too where it is another one. */
export function localTime(iso: string, timeZone: string): string {
  const moment = new Date(iso);
  if (Number.isNaN(moment.getTime())) {
    return DASH;
  }
  const parts = new Map<string, string>(
    new Intl.DateTimeFormat("en-GB", {
      timeZone,
      dateStyle: "short",
      timeStyle: "long",
    })
      .formatToParts(moment)
      .map(({ type, value }) => [type, value]),
  );
  const get = (type: string): string => parts.get(type) ?? "";
  const date = `${get("year")}-${get("month")}-${get("day")}`;
  const time = `${get("hour")}:${get("minute")}:${get("second")}${FIXED_SPACE}${get("timeZoneName")}`;
  return date === moment.toISOString().slice(0, 10) ? time : `${date} ${time}`;
}
