/**
 * The import page's island: sends the chosen folder or files and shows how far it is; tries a time
 * rule at once. Whatever breaks off is gone on with by choosing the same again.
 */
import { explain } from "./api";
import { number } from "./format";
import { Batch, begin } from "./import/batch";
import type { Chosen } from "./import/gather";
import { fromDrop, fromInput } from "./import/gather";
import { Pace, megabytes, told } from "./import/pace";
import { watchTimes } from "./import/times";

for (const root of document.querySelectorAll<HTMLElement>("[data-import]")) {
  enable(root);
}
for (const form of document.querySelectorAll<HTMLFormElement>("form[data-times]")) {
  watchTimes(form);
}

function enable(root: HTMLElement): void {
  const zone = part(root, "zone");
  for (const name of ["folder", "files"]) {
    const input = part(root, name) as HTMLInputElement;
    const take = (): void => {
      void run(root, fromInput(input.files ?? []));
    };
    input.addEventListener("change", take);
    take(); // what was chosen before this script had come
  }
  zone.addEventListener("dragover", (event) => {
    event.preventDefault();
    zone.classList.add("is-over");
  });
  zone.addEventListener("dragleave", () => {
    zone.classList.remove("is-over");
  });
  zone.addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("is-over");
    if (event.dataTransfer !== null) {
      void fromDrop(event.dataTransfer).then((chosen) => run(root, chosen));
    }
  });
}

async function run(root: HTMLElement, chosen: readonly Chosen[]): Promise<void> {
  if (chosen.length === 0) {
    return;
  }
  const says = part(root, "says");
  part(root, "zone").hidden = true;
  part(root, "progress").hidden = false;
  says.textContent = `Looking at ${number(chosen.length)} files.`;
  window.addEventListener("beforeunload", askFirst);
  let refused = 0;
  try {
    const id = Number(root.dataset["batch"]) || (await beginFor(root, chosen));
    const batch = new Batch(
      id,
      {
        onProgress: progressOf(root),
        onRefused: (path, reason) => {
          refused += 1;
          listRefused(root, path, reason);
        },
        onPause: (reason) => {
          says.textContent = reason === "" ? "" : `${reason} Going on by itself.`;
        },
      },
      root.dataset["hashes"] !== undefined,
    );
    await batch.send(chosen);
    window.removeEventListener("beforeunload", askFirst);
    const done = `/imports/${id}#check`;
    if (refused === 0) {
      location.assign(done);
      location.reload(); // the address may differ by its fragment only
    } else {
      part(root, "right").textContent = "";
      const count = refused === 1 ? "One archive was" : `${number(refused)} archives were`;
      says.replaceChildren(`${count} refused. All else has come. `, linkTo(`/imports/${id}`));
    }
  } catch (error) {
    window.removeEventListener("beforeunload", askFirst);
    part(root, "zone").hidden = false;
    says.textContent = `${explain(error)} Choose the same again to go on.`;
  }
}

async function beginFor(root: HTMLElement, chosen: readonly Chosen[]): Promise<number> {
  const first = chosen[0]?.path ?? "";
  const folder = first.includes("/") ? first.slice(0, first.indexOf("/")) : first;
  const id = await begin(Number(root.dataset["camera"]), folder.slice(0, 200).trim() || "Batch");
  root.dataset["batch"] = String(id);
  // A reload now finds the batch, not the page that would begin another one.
  history.replaceState(null, "", `/imports/${id}`);
  return id;
}

function progressOf(root: HTMLElement): (sent: number, all: number) => void {
  const bar = part(root, "progress").querySelector("progress");
  const says = part(root, "says");
  const pace = new Pace();
  return (sent, all) => {
    pace.note(performance.now(), sent);
    if (bar !== null) {
      bar.value = all === 0 ? 1 : sent / all;
    }
    part(root, "left").textContent = `${megabytes(sent)} of ${megabytes(all)} MB`;
    part(root, "right").textContent = told(pace.rate(), all - sent);
    says.textContent = "";
  };
}

function listRefused(root: HTMLElement, path: string, reason: string): void {
  const item = document.createElement("li");
  item.className = "upload-item";
  const name = document.createElement("span");
  name.className = "upload-item__name";
  name.textContent = path;
  const why = document.createElement("span");
  why.className = "field__error";
  why.textContent = reason.replace(/^file: /, "");
  item.append(name, why);
  part(root, "refused").append(item);
}

function linkTo(href: string): HTMLAnchorElement {
  const link = document.createElement("a");
  link.href = href;
  link.textContent = "Look at it";
  return link;
}

function askFirst(event: BeforeUnloadEvent): void {
  event.preventDefault();
}

function part(root: HTMLElement, name: string): HTMLElement {
  const found = root.querySelector<HTMLElement>(`[data-import-${name}]`);
  if (found === null) {
    throw new Error(`the page has no ${name}`);
  }
  return found;
}
