/** The side panel: what is known of the current pose, in the order a reviewer asks for it. */
import { heading, number, position, quantity, utc } from "../format";
import { copyOf, element, part } from "../page/parts";
import { costInWords, type CostPart } from "./cost";
import { GRADE_NAMES, vesselName, type Grade, type Pose } from "./pose";
import { shipType } from "./ship-type";

type Fact = readonly [name: string, value: string];

export class FactsPanel {
  constructor(private readonly root: HTMLElement) {}

  show(pose: Pose, grade: Grade | null): void {
    part(this.root, "vessel-name").textContent = vesselName(pose);
    part(this.root, "vessel-kind").textContent = kind(pose);
    this.showGrade(pose, grade);
    fill(part(this.root, "vessel-facts"), vesselFacts(pose));
    fill(part(this.root, "fit-facts"), fitFacts(pose));
    this.showCost(pose);
    this.showFlags(pose.flags);
    fill(part(this.root, "image-facts"), [
      ["Taken", utc(pose.image.captured_at)],
      ["File", pose.image.file_name],
    ]);
    part(this.root, "image-link").setAttribute("href", pose.image.file_url);
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

  private showCost(pose: Pose): void {
    part(this.root, "cost").textContent = number(pose.cost, 3);
    const { summands, dividedBy } = costInWords(pose.cost_terms);
    const largest = Math.max(1e-9, ...summands.map(({ value }) => value));
    part(this.root, "cost-terms").replaceChildren(
      ...summands.map((summand) => costTerm(summand, largest)),
    );
    part(this.root, "cost-divisor").textContent =
      dividedBy === null ? "" : `divided by ${dividedBy.name} ${number(dividedBy.value, 2)}`;
  }

  private showFlags(flags: readonly string[]): void {
    const target = part(this.root, "flags");
    target.hidden = flags.length === 0;
    target.replaceChildren(
      ...flags.map((flag) => element("li", "badge badge--warning", inWords(flag))),
    );
  }
}

/** What a screen reader hears when a pose comes up. */
export function announcement(pose: Pose, grade: Grade | null, index: number, total: number): string {
  const verdict = grade === null ? "not graded" : `graded ${GRADE_NAMES[grade]}`;
  return `Pose ${index + 1} of ${total}, ${vesselName(pose)}, ${verdict}`;
}

function kind(pose: Pose): string {
  const mmsi = `MMSI ${pose.vessel.mmsi}`;
  const type = shipType(pose.vessel.ship_type);
  return type === null ? mmsi : `${type}, ${mmsi}`;
}

function vesselFacts(pose: Pose): Fact[] {
  const size = [pose.length_m, pose.width_m, pose.height_m].map((value) => number(value, 1));
  return [
    ["Size", `${size.join(" × ")}\u00a0m`],
    ["Heading", `${heading(pose.heading_deg)}, ${inWords(pose.heading_source)}`],
    ["Report age", quantity(pose.report_age_s, "s", 1)],
    ["Position", position(pose.position.lat_deg, pose.position.lon_deg)],
  ];
}

function fitFacts(pose: Pose): Fact[] {
  const [east = 0, north = 0] = pose.correction_in_enu_m;
  return [
    ["Range", quantity(Math.hypot(...pose.centroid_in_cam_m), "m")],
    ["Correction", quantity(Math.hypot(east, north), "m", 1)],
    ["East, north", `${number(east, 1)}, ${number(north, 1)} m`],
    ["Detection", `score ${number(pose.detection.score, 2)}`],
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

function inWords(code: string): string {
  return code.replaceAll("_", " ");
}
