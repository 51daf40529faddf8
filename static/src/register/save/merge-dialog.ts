/** Somebody else saved meanwhile: shows what they changed and lets a person choose where both did. */
import { element, part } from "../../page/parts";
import { describeChange, type Conflict, type Merge, type Side } from "../model/merge";
import type { Points } from "../model/point";

/** Asks; resolves to the merged points, or null when the person leaves it for later. */
export function askMerge(dialog: HTMLDialogElement, merge: Merge, base: Points): Promise<Points | null> {
  const choices = new Map<string, Side>(merge.conflicts.map(({ key }) => [key, "mine"]));
  part(dialog, "merge-taken").replaceChildren(
    ...merge.taken.map(({ before, after }) => {
      const item = element("li");
      const name = element("strong", "", (before ?? after)?.name ?? "");
      item.append(name, `: ${describeChange(before, after)}`);
      return item;
    }),
  );
  part(dialog, "merge-taken-title").hidden = merge.taken.length === 0;
  part(dialog, "merge-conflicts").replaceChildren(
    ...merge.conflicts.map((conflict) => conflictRow(conflict, base, choices)),
  );
  part(dialog, "merge-conflicts-title").hidden = merge.conflicts.length === 0;
  dialog.returnValue = "";
  dialog.showModal();
  return new Promise((resolve) => {
    const take = part(dialog, "merge-take");
    const onTake = (): void => {
      dialog.close("merged");
    };
    take.addEventListener("click", onTake);
    dialog.addEventListener(
      "close",
      () => {
        take.removeEventListener("click", onTake);
        resolve(dialog.returnValue === "merged" ? merge.resolve(choices) : null);
      },
      { once: true },
    );
  });
}

function conflictRow({ key, mine, theirs }: Conflict, base: Points, choices: Map<string, Side>): HTMLElement {
  const before = base.find((point) => point.key === key) ?? null;
  const name = (mine ?? theirs ?? before)?.name ?? "";
  const fieldset = element("fieldset", "merge-conflict");
  fieldset.append(element("legend", "", name));
  for (const side of ["mine", "theirs"] as const) {
    const label = element("label", "choice");
    const radio = element("input");
    radio.type = "radio";
    radio.name = `merge-${key}`;
    radio.checked = side === "mine";
    radio.addEventListener("change", () => {
      choices.set(key, side);
    });
    const after = side === "mine" ? mine : theirs;
    const who = side === "mine" ? "Yours" : "Theirs";
    label.append(radio, element("span", "", `${who}: ${describeChange(before, after)}`));
    fieldset.append(label);
  }
  return fieldset;
}
