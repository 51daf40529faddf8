/** Writing a comment on a pose or an image, and reading those that are there. */
import { call, explain } from "../api";
import { utc } from "../format";
import { element, part } from "../page/parts";
import { vesselName } from "./pose";
import type { Stop } from "./session";

interface Comment {
  readonly user: string | null;
  readonly text: string;
  readonly created_at: string;
}

export class CommentBox {
  private readonly dialog: HTMLDialogElement;
  private readonly field: HTMLTextAreaElement;
  private about: Stop | null = null;

  constructor(
    root: ParentNode,
    private readonly onComment: (stop: Stop, text: string) => void,
  ) {
    this.dialog = part(root, "comment-dialog") as HTMLDialogElement;
    this.field = part(this.dialog, "comment-text") as HTMLTextAreaElement;
    part(this.dialog, "comment-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.save();
    });
    this.field.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.shiftKey && !event.isComposing) {
        event.preventDefault();
        this.save();
      }
    });
  }

  open(stop: Stop): void {
    this.about = stop;
    const { pose, image } = stop;
    part(this.dialog, "comment-about").textContent =
      pose === null ? `Image ${image.file_name}` : vesselName(pose);
    part(this.dialog, "comments").replaceChildren();
    this.field.value = "";
    this.dialog.showModal();
    this.field.focus();
    void this.showEarlier(stop);
  }

  private save(): void {
    const text = this.field.value.trim();
    if (text !== "" && this.about !== null) {
      this.onComment(this.about, text);
    }
    this.dialog.close();
  }

  private async showEarlier(stop: Stop): Promise<void> {
    const { pose, image } = stop;
    const path = pose === null ? `images/${image.id}` : `poses/${pose.id}`;
    const list = part(this.dialog, "comments");
    try {
      const page = (await call(`/api/v1/${path}/comments`)) as { items: readonly Comment[] };
      if (this.about === stop) {
        list.replaceChildren(...page.items.map(line));
      }
    } catch (error) {
      list.replaceChildren(element("li", "muted", `Earlier comments: ${explain(error)}`));
    }
  }
}

function line({ user, text, created_at }: Comment): HTMLElement {
  const item = element("li", "comments__item");
  item.append(
    element("span", "muted small", `${user ?? "Someone"}, ${utc(created_at)}`),
    element("p", "", text),
  );
  return item;
}
