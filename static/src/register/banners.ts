/** What the next click does, said on the photograph and on the map. */
import { part } from "../page/parts";
import type { Editor } from "./editor";

export function showBanners(root: HTMLElement, editor: Editor): void {
  const [image, map] = [part(root, "banner"), part(root, "map-banner")];
  const show = (): void => {
    const { armed, selected, mayEdit } = editor;
    image.classList.toggle("is-armed", armed !== null);
    root.classList.toggle("is-placing", armed !== null);
    image.textContent = !mayEdit
      ? "You may look; placing keypoints needs the role operator."
      : armed !== null
        ? `Click where you see ${armed.name}. Esc leaves it.`
        : "Click to add a keypoint, drag one to move it.";
    const waits = mayEdit && selected !== null && selected.place === null;
    root.classList.toggle("is-locating", waits);
    map.hidden = !waits;
    map.textContent = waits ? `Click where ${selected.name} stands.` : "";
  };
  editor.listen((changes) => {
    if (changes.has("selection") || changes.has("points")) {
      show();
    }
  });
  show();
}
