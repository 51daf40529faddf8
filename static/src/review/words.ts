/** What the codes of poses, vessels and marks say, in words a reviewer can act on. */
import type { MissedReason } from "./surroundings";

const FLAGS: ReadonlyMap<string, string> = new Map([
  ["cut_left", "Cut by the left border: placed by its right side alone"],
  ["cut_right", "Cut by the right border: placed by its left side alone"],
  ["cut_bottom", "Cut by the lower border: the range is AIS's own"],
  ["cut_top", "Cut by the upper border: it may be higher"],
  ["no_length", "AIS gives no length"],
  ["no_width", "AIS gives no width"],
  ["no_height", "No height: the detection ends below the water plane"],
  ["unsure_place", "Its place is known to more than 10 m only"],
  ["partly_hidden", "Not wholly in its detection: it may be higher than what is seen"],
  ["contradicts_ais", "The image and AIS hardly agree: maybe another vessel"],
  ["heading_not_reported", "AIS gives no heading: see where this one is from"],
  ["later_size", "AIS gave its size only after the image"],
  ["antenna_unknown", "AIS does not say where the antenna stands: put amidships"],
  ["size_at_least", "Larger than AIS can say"],
  ["auxiliary_craft", "A boat or tender of another ship"],
  ["jump", "Its AIS position jumped"],
  ["two_places", "Two vessels seem to use its MMSI"],
  ["impossible_speed", "AIS says it is faster than anything afloat"],
  ["far_away", "Its AIS position is far from this site"],
  ["doubtful_time", "The time of its AIS position is doubtful"],
  ["clock_suspect", "Clock suspect: the camera's time is off, so this may be another vessel"],
  ["receiver_clock", "The AIS receiver's clock seems wrong"],
]);

const HEADING_SOURCES: ReadonlyMap<string, string> = new Map([
  ["reported", "from its gyro or compass"],
  ["course", "from its course over ground"],
  ["held", "held from when it last moved"],
  ["track", "from where it went"],
]);

/** How a position was carried from the reports to the image's time. */
const TRACK_METHODS: ReadonlyMap<string, string> = new Map([
  ["heading_dr", "along its heading"],
  ["cog_dr", "along its course"],
  ["ctrv_damped", "along its turn"],
  ["hermite", "between reports"],
]);

/** Why a vessel known from AIS has no box. */
const OUTCOMES: ReadonlyMap<string, string> = new Map([
  ["matched", "has a box"],
  ["no_position", "no position"],
  ["no_heading", "no heading"],
  ["report_too_old", "report too old"],
  ["out_of_range", "too far away"],
  ["behind_camera", "behind the camera"],
  ["outside_image", "outside the image"],
  ["no_detection_left", "no detection left"],
  ["cost_too_high", "cost too high"],
  ["size_unknown", "size unknown"],
  ["clock_suspect", "clock suspect: match withheld"],
]);

export const MISSED_WORDS: Readonly<Record<MissedReason, string>> = {
  not_detected: "Not detected",
  no_ais: "No AIS",
  neither: "Neither",
  cost_too_high: "Cost too high",
};

export const flagInWords = (code: string): string => FLAGS.get(code) ?? plain(code);
export const headingSourceInWords = (code: string): string =>
  HEADING_SOURCES.get(code) ?? plain(code);
export const trackMethodInWords = (code: string): string => TRACK_METHODS.get(code) ?? plain(code);
export const outcomeInWords = (code: string): string => OUTCOMES.get(code) ?? plain(code);

/** A code nobody has put into words yet. */
function plain(code: string): string {
  return code.replaceAll("_", " ");
}
