/** Beside the map: the vessel that was chosen, and all in sight at the moment, for keyboards too. */
import { heading, number, position, quantity } from "../format";
import { element, part } from "../page/parts";
import { titleOf, type Present } from "./drawing";
import { ago } from "./live-words";
import { latOf, lonOf, type Track } from "./track-store";

const MOST_LISTED = 200;
const FLAGS: Readonly<Record<string, string>> = {
  jump: "position jumps",
  two_places: "one number in two places",
  impossible_speed: "impossible speed",
  far_away: "far away",
  doubtful_time: "its clock is off",
  receiver_clock: "receiver's clock is off",
};

export class VesselPanel {
  private readonly list: HTMLElement;
  private readonly count: HTMLElement;
  private readonly chosen: HTMLElement;
  private listed: readonly (Track | null)[] = [];

  constructor(
    root: HTMLElement,
    private readonly choose: (track: Track | null) => void,
  ) {
    this.list = part(root, "vessels");
    this.count = part(root, "count");
    this.chosen = part(root, "chosen");
  }

  showList(present: readonly Present[], chosen: Track | null): void {
    const sorted = [...present].sort((a, b) => titleOf(a.track).localeCompare(titleOf(b.track)));
    const shown = sorted.slice(0, MOST_LISTED);
    const more = sorted.length - shown.length;
    this.count.textContent =
      `${number(present.length)} in sight` + (more > 0 ? `, the first ${MOST_LISTED} listed` : "");
    // By the tracks themselves: what comes later is joined to new ones, with more flags perhaps.
    const listed = [chosen, ...shown.map(({ track }) => track)];
    if (listed.length === this.listed.length && listed.every((one, i) => one === this.listed[i])) {
      return;
    }
    this.listed = listed;
    const focused = (document.activeElement as HTMLElement | null)?.dataset["vessel"];
    this.list.replaceChildren(...shown.map(({ track }) => this.line(track, track === chosen)));
    if (focused !== undefined) {
      this.list.querySelector<HTMLElement>(`[data-vessel="${CSS.escape(focused)}"]`)?.focus();
    }
  }

  private line(track: Track, isChosen: boolean): HTMLElement {
    const item = element("li");
    const button = element("button", "traffic__vessel", titleOf(track));
    button.type = "button";
    button.dataset["vessel"] = String(track.id);
    button.setAttribute("aria-pressed", String(isChosen));
    button.addEventListener("click", () => {
      this.choose(isChosen ? null : track);
    });
    const notes = [track.about.ais_class === null ? "" : `class ${track.about.ais_class}`, ...(track.flags.size > 0 ? ["doubtful"] : [])];
    button.append(element("span", "muted small", notes.filter((note) => note !== "").join(", ")));
    item.append(button);
    return item;
  }

  showChosen(track: Track | null, present: Present | undefined): void {
    this.chosen.hidden = track === null;
    if (track === null) {
      return;
    }
    const { about, id, flags } = track;
    const facts: [string, string][] = [
      [typeof id === "number" ? "MMSI" : "Pseudonym", String(id)],
      ["Class", about.ais_class ?? "–"],
      ["Type", about.ship_type ?? "–"],
      ["Size", about.length_m === null ? "–" : `${number(about.length_m)} × ${quantity(about.width_m, "m")}`],
      ["Flags", [...flags].map((flag) => FLAGS[flag] ?? flag).join(", ") || "none"],
    ];
    if (present === undefined) {
      facts.push(["Now", "silent"]);
    } else {
      const { at } = present;
      facts.push(
        ["Speed", quantity(at.sogKn, "kn", 1)],
        [at.isCourse && at.headingDeg !== null ? "Course" : "Heading", heading(at.headingDeg)],
        ["Place", position(latOf(at.y), lonOf(at.x))],
        ["Heard", at.silentS > 0 ? `last ${ago(at.silentS)} ago` : "before and after"],
      );
    }
    const list = element("dl", "facts");
    for (const [name, value] of facts) {
      list.append(element("dt", "", name), element("dd", "", value));
    }
    const link = element("a", "button button--small", "Open its page");
    link.href = `/ais/vessels/${encodeURIComponent(String(id))}`;
    this.chosen.replaceChildren(element("h2", "", titleOf(track)), list, link);
  }
}
