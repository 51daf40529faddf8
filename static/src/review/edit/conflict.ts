/**
 * Somebody else saved a correction meanwhile: shows what differs and lets a person take each value
 * from one side or the other. Nothing is overwritten unseen.
 */
import { element, part } from "../../page/parts";
import type { Difference, Part, Side } from "./merge";

export type Choice =
  | { readonly kind: "merge"; readonly sides: ReadonlyMap<Part, Side> }
  | { readonly kind: "theirs" | "edit-on" };

export class ConflictDialog {
  private readonly dialog: HTMLDialogElement;

  constructor(root: ParentNode) {
    const dialog = root.querySelector("#edit-conflict");
    if (!(dialog instanceof HTMLDialogElement)) {
      throw new Error('The template lacks <dialog id="edit-conflict">.');
    }
    this.dialog = dialog;
  }

  /** Resolves once the person has chosen; closing the dialog means to edit on. */
  ask(who: string, differing: readonly Difference[]): Promise<Choice> {
    part(this.dialog, "conflict-who").textContent = who;
    part(this.dialog, "conflict-parts").replaceChildren(...differing.map(question));
    return new Promise((resolve) => {
      const settle = (choice: Choice): void => {
        this.dialog.removeEventListener("close", onClose);
        this.dialog.close();
        resolve(choice);
      };
      const onClose = (): void => {
        settle({ kind: "edit-on" });
      };
      this.dialog.addEventListener("close", onClose);
      part(this.dialog, "conflict-merge").onclick = () => {
        settle({ kind: "merge", sides: this.sides(differing) });
      };
      part(this.dialog, "conflict-theirs").onclick = () => {
        settle({ kind: "theirs" });
      };
      this.dialog.showModal();
    });
  }

  private sides(differing: readonly Difference[]): ReadonlyMap<Part, Side> {
    return new Map(
      differing.map(({ part: name }) => {
        const theirs = this.dialog.querySelector<HTMLInputElement>(
          `input[name="conflict-${name}"][value="theirs"]`,
        );
        return [name, theirs?.checked === true ? "theirs" : "mine"];
      }),
    );
  }
}

function question({ part: name, name: words, mine, theirs }: Difference): HTMLElement {
  const group = element("fieldset", "conflict-part");
  group.append(
    element("legend", "", words),
    option(name, "mine", `Yours: ${mine}`, true),
    option(name, "theirs", `Theirs: ${theirs}`, false),
  );
  return group;
}

function option(name: Part, side: Side, words: string, checked: boolean): HTMLElement {
  const label = element("label", "choice");
  const radio = element("input");
  radio.type = "radio";
  radio.name = `conflict-${name}`;
  radio.value = side;
  radio.checked = checked;
  label.append(radio, element("span", "", words));
  return label;
}
