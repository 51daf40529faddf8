/** Which photograph of the viewport is looked at: keypoints hold for all of them. */
import { utc } from "../format";
import { element, part } from "../page/parts";
import type { ImageJson } from "./api";

export class PhotoChoice {
  private readonly select: HTMLSelectElement;

  constructor(
    root: HTMLElement,
    private readonly images: readonly ImageJson[],
    private readonly onShow: (image: ImageJson) => void,
  ) {
    this.select = part(root, "image-select") as HTMLSelectElement;
    this.select.append(
      ...images.map((image, index) => {
        const option = element("option", "", `${utc(image.captured_at)}  ${image.file_name}`);
        option.value = String(index);
        return option;
      }),
    );
    this.select.addEventListener("change", () => {
      this.show(Number(this.select.value));
    });
    if (images.length === 0) {
      this.select.append(element("option", "", "No photographs yet"));
      this.select.disabled = true;
      const camera = element("a", "", "Upload some of its time");
      camera.href = `/cameras/${root.dataset["camera"] ?? ""}`;
      part(root, "note").replaceChildren("This viewport has no photographs yet. ", camera, ".");
    }
  }

  showFirst(): void {
    this.show(0);
  }

  step(by: 1 | -1): void {
    const count = this.images.length;
    if (count > 0) {
      this.show((Number(this.select.value) + by + count) % count);
    }
  }

  private show(index: number): void {
    const image = this.images[index];
    if (image !== undefined) {
      this.select.value = String(index);
      this.onShow(image);
    }
  }
}
