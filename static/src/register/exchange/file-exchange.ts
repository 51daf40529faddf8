/** Keypoints as files: chosen or dropped ones come in by way of a preview, downloads go out. */
import { showFlash } from "../../page/flashes";
import { part } from "../../page/parts";
import type { Editor } from "../editor";
import { writeCsv } from "./csv";
import { writeGeoJson } from "./geojson";
import { askImport } from "./import-dialog";
import { planImport } from "./import-plan";
import { readFile } from "./read-file";

export class FileExchange {
  constructor(
    private readonly root: HTMLElement,
    private readonly editor: Editor,
    private readonly dialog: HTMLDialogElement,
    private readonly fileName: string,
  ) {
    const chooser = part(root, "import-chooser") as HTMLInputElement;
    chooser.addEventListener("change", () => {
      const file = chooser.files?.[0];
      chooser.value = "";
      void this.take(file);
    });
    root.addEventListener("dragover", (event) => {
      if (event.dataTransfer?.types.includes("Files") === true && editor.mayEdit) {
        event.preventDefault();
        root.classList.add("is-dropping");
      }
    });
    root.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null || !root.contains(event.relatedTarget as Node)) {
        root.classList.remove("is-dropping");
      }
    });
    root.addEventListener("drop", (event) => {
      event.preventDefault();
      root.classList.remove("is-dropping");
      void this.take(event.dataTransfer?.files[0]);
    });
    part(root, "export-csv").addEventListener("click", () => {
      download(`${this.fileName}.csv`, "text/csv", writeCsv(editor.points));
    });
    part(root, "export-geojson").addEventListener("click", () => {
      download(`${this.fileName}.geojson`, "application/geo+json", writeGeoJson(editor.points));
    });
  }

  choose(): void {
    part(this.root, "import-chooser").click();
  }

  private async take(file: File | undefined): Promise<void> {
    const { editor } = this;
    if (file === undefined || !editor.mayEdit) {
      return;
    }
    const { points, landmarks, world } = editor;
    const plan = planImport(await readFile(file), {
      points,
      landmarks,
      frame: world.frame,
      intrinsics: world.intrinsics,
    });
    if (await askImport(this.dialog, file.name, plan)) {
      editor.edit(plan.points, `import ${file.name}`);
      showFlash(`${plan.changes} keypoint${plan.changes === 1 ? "" : "s"} imported. Save to keep ${plan.changes === 1 ? "it" : "them"}.`, "success");
    }
  }
}

function download(name: string, type: string, text: string): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  URL.revokeObjectURL(url);
}
