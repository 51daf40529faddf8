/** The side panel: what is known of the current pose, in the order a reviewer asks for it. */
import { heading, localTime, number, position, quantity, utc } from "../format";
import { copyOf, element, part } from "../page/parts";
import { correctionOf, type Correction } from "./correction";
import { costInWords, type CostPart } from "./cost";
import { GRADE_NAMES, vesselName, type Grade, type Pose } from "./pose";
import { ellipseOf } from "./map/ellipse";
import { shipType } from "./ship-type";
import { flagInWords, headingSourceInWords, trackMethodInWords } from "./words";
import { idText } from "../vessel-id";

type Fact = readonly [name: string, value: string];

export class FactsPanel {
  constructor(
    private readonly root: HTMLElement,
    private readonly timeZone: string,
  ) {}

  show(pose: Pose, grade: Grade | null): void {
    this.root.classList.remove("has-no-pose");
    part(this.root, "vessel-name").textContent = shownName(pose);
    part(this.root, "vessel-kind").textContent = kind(pose);
    this.showGrade(pose, grade);
    this.showCorrection(correctionOf(pose));
    fill(part(this.root, "vessel-facts"), vesselFacts(pose));
    fill(part(this.root, "fit-facts"), fitFacts(pose));
    this.showCost(pose);
    this.showFlags(pose.flags);
    this.showImage(pose.image);
  }

  /** An image without a pose: only what is known of the photograph. */
  showImageAlone(image: Pose["image"], words: string): void {
    this.root.classList.add("has-no-pose");
    part(this.root, "vessel-name").textContent = "The whole image";
    part(this.root, "vessel-kind").textContent = words;
    this.showImage(image);
  }

  showMap(map: Element | null): void {
    part(this.root, "map").replaceChildren(...(map === null ? [] : [map]));
  }

  private showImage(image: Pose["image"]): void {
    const there = localTime(image.captured_at, this.timeZone);
    fill(part(this.root, "image-facts"), [
      ["Taken", utc(image.captured_at)],
      ...(this.timeZone === "UTC" ? [] : [["Local time", there] as const]),
      ["File", image.file_name],
    ]);
    part(this.root, "image-link").setAttribute("href", image.file_url);
  }

  private showGrade(pose: Pose, grade: Grade | null): void {
    const target = part(this.root, "grade");
    target.replaceChildren(copyOf(this.root.ownerDocument, grade ?? "ungraded"));
    const review = grade !== null && pose.review?.grade === grade ? pose.review : null;
    const reviewer = review?.user ?? null;
    part(this.root, "grade-by").textContent = reviewer === null ? "" : `by ${reviewer}`;
    const comment = part(this.root, "comment");
    comment.textContent = review?.comment ?? "";
    comment.hidden = comment.textContent === "";
  }

  private showCorrection(correction: Correction | null): void {
    const target = part(this.root, "corrected");
    target.hidden = correction === null;
    if (correction !== null) {
      const what = correction.kind === "rematched" ? "Matched anew" : "Corrected";
      const who = correction.user === null ? "" : ` by ${correction.user}`;
      target.textContent = `${what}${who}, ${utc(correction.created_at)}. The generated box is kept.`;
    }
  }

  private showCost(pose: Pose): void {
    const byHand = correctionOf(pose);
    const { cost, cost_terms: terms } =
      byHand?.kind === "rematched" && byHand.cost !== null && byHand.cost_terms !== null
        ? { cost: byHand.cost, cost_terms: byHand.cost_terms }
        : pose;
    part(this.root, "cost").textContent = number(cost, 3);
    const { summands, dividedBy, probability } = costInWords(terms);
    const largest = Math.max(1e-9, ...summands.map(({ value }) => value));
    part(this.root, "cost-terms").replaceChildren(
      ...summands.map((summand) => costTerm(summand, largest)),
    );
    part(this.root, "cost-divisor").textContent = [
      dividedBy === null ? "" : `divided by ${dividedBy.name} ${number(dividedBy.value, 2)}`,
      probability === null ? "" : `this vessel: ${number(100 * probability, 1)} %`,
    ].join("");
  }

  private showFlags(flags: readonly string[]): void {
    const target = part(this.root, "flags");
    target.hidden = flags.length === 0;
    target.replaceChildren(
      ...flags.map((flag) => element("li", "badge badge--warning", flagInWords(flag))),
    );
  }
}

/** What a screen reader hears when a pose comes up. */
export function announcement(pose: Pose, grade: Grade | null, index: number, total: number): string {
  const verdict = grade === null ? "not graded" : `graded ${GRADE_NAMES[grade]}`;
  return `Pose ${index + 1} of ${total}, ${vesselName(pose)}, ${verdict}`;
}

/** The vessel a person matched it with, else the generated one. */
function shownVessel(pose: Pose): Pose["vessel"] {
  return correctionOf(pose)?.vessel ?? pose.vessel;
}

function shownName(pose: Pose): string {
  return vesselName({ ...pose, vessel: shownVessel(pose) });
}

function kind(pose: Pose): string {
  const { mmsi: vessel, ship_type: code } = shownVessel(pose);
  const mmsi = idText(vessel);
  const type = shipType(code);
  return type === null ? mmsi : `${type}, ${mmsi}`;
}

function vesselFacts(pose: Pose): Fact[] {
  const box = correctionOf(pose) ?? pose;
  const size = [box.length_m, box.width_m, box.height_m].map((value) => number(value, 1));
  const source = correctionOf(pose)?.kind === "edited" ? "set by hand" : null;
  return [
    ["Size", `${size.join(" × ")}\u00a0m`],
    ["Heading", `${heading(box.heading_deg)}, ${source ?? headingSourceInWords(pose.heading_source)}`],
    ["Speed", quantity(pose.speed_kn, "kn", 1)],
    ["Report age", quantity(pose.report_age_s, "s", 1)],
    ...trackFacts(pose),
    ["Position", position(pose.position.lat_deg, pose.position.lon_deg)],
  ];
}

/** How AIS led to the place at the image's time; runs of old do not know. */
function trackFacts({ track_method: method, report_ids: reports }: Pose): Fact[] {
  if (method === null) {
    return [];
  }
  const count = reports.length === 1 ? "1 report" : `${reports.length} reports`;
  return [["Placed", `${trackMethodInWords(method)}, ${count}`]];
}

function fitFacts(pose: Pose): Fact[] {
  const [east = 0, north = 0, up = 0] = pose.correction_in_enu_m;
  return [
    ["Range", quantity(Math.hypot(...pose.centroid_in_cam_m), "m")],
    ["Moved", `${quantity(Math.hypot(east, north), "m", 1)} from AIS`],
    ["E, N, up", `${number(east, 1)}, ${number(north, 1)}, ${quantity(up, "m", 1)}`],
    ["Detection", `score ${number(pose.detection.score, 2)}`],
    ...certaintyFacts(pose),
  ];
}

/** How sure the generated box is, one standard deviation each; a person's is not measured. */
function certaintyFacts(pose: Pose): Fact[] {
  if (correctionOf(pose)?.kind === "edited") {
    return [];
  }
  const ellipse = ellipseOf(pose);
  if (ellipse === null || pose.heading_sigma_deg === null || pose.height_sigma_m === null) {
    return [["Known to", "not told by preset paper"]];
  }
  const place = `${number(ellipse.longM, 1)} × ${quantity(ellipse.shortM, "m", 1)}`;
  return [
    ["Place", `± ${place}, the longer at ${heading(ellipse.bearingDeg)}`],
    ["Heading", `± ${number(pose.heading_sigma_deg, 1)}°`],
    ["Height", `± ${quantity(pose.height_sigma_m, "m", 1)}`],
  ];
}

function costTerm({ name, value }: CostPart, largest: number): HTMLElement {
  const row = element("li", "cost-term");
  const bar = element("progress");
  bar.max = largest;
  bar.value = value;
  bar.setAttribute("aria-label", name);
  row.append(element("span", "", name), bar, element("span", "number", number(value, 3)));
  return row;
}

function fill(list: HTMLElement, facts: readonly Fact[]): void {
  list.replaceChildren(
    ...facts.flatMap(([name, value]) => [element("dt", "", name), element("dd", "", value)]),
  );
}
