/** Before a file is imported: every line with what it would do, errors by line. */
import { element, part } from "../../page/parts";
import type { Effect, ImportPlan } from "./import-plan";

const WORDS: Readonly<Record<Effect | "error", string>> = {
  new: "new",
  changes: "changes",
  unchanged: "as it is",
  error: "error",
};
const TONES: Readonly<Record<Effect | "error", string>> = {
  new: "badge--success",
  changes: "badge--accent",
  unchanged: "",
  error: "badge--danger",
};

/** Asks; resolves to true when the plan is to be carried out. */
export function askImport(dialog: HTMLDialogElement, fileName: string, plan: ImportPlan): Promise<boolean> {
  part(dialog, "import-file").textContent = fileName;
  part(dialog, "import-rows").replaceChildren(
    ...plan.lines.map(({ line, name, effect, note }) => {
      const row = element("tr", effect === "error" ? "is-wrong" : "");
      const state = element("td");
      state.append(element("span", `badge ${TONES[effect]}`, WORDS[effect]));
      row.append(element("td", "is-number", String(line)), element("td", "", name), state, element("td", "", note));
      return row;
    }),
  );
  const { errors, changes } = plan;
  part(dialog, "import-summary").textContent = summary(errors, changes);
  const take = part(dialog, "import-take") as HTMLButtonElement;
  take.hidden = changes === 0;
  take.textContent = errors > 0 ? `Import the ${changes} good line${changes === 1 ? "" : "s"}` : `Import ${changes} keypoint${changes === 1 ? "" : "s"}`;
  dialog.returnValue = "";
  dialog.showModal();
  return new Promise((resolve) => {
    const onTake = (): void => {
      dialog.close("take");
    };
    take.addEventListener("click", onTake);
    dialog.addEventListener(
      "close",
      () => {
        take.removeEventListener("click", onTake);
        resolve(dialog.returnValue === "take");
      },
      { once: true },
    );
  });
}

function summary(errors: number, changes: number): string {
  if (errors === 0) {
    return changes === 0 ? "Nothing in this file differs from what is here." : "Every line is understood. Undo takes the import back.";
  }
  const lines = errors === 1 ? "1 line has an error" : `${errors} lines have errors`;
  return `${lines}. Correct the file and choose it again${changes > 0 ? ", or import the good lines only" : ""}.`;
}
