/**
 * The image upload form's island: several photographs, three at a time, each with its own progress
 * and, where it is refused, the reason beside its name. Without scripts the form posts as it is.
 */
import { explain } from "./api";
import { number } from "./format";
import { eachAtMost } from "./upload/queue";
import { sendFile } from "./upload/send-file";
import { lacksTime, timeQuestion } from "./upload/time-question";

const AT_ONCE = 3;

interface Entry {
  readonly file: File;
  readonly item: HTMLElement;
  readonly bar: HTMLProgressElement;
  readonly state: HTMLElement;
  result: "waiting" | "stored" | "known" | "failed";
}

for (const form of document.querySelectorAll<HTMLFormElement>("form[data-upload]")) {
  enable(form);
}

function enable(form: HTMLFormElement): void {
  const input = form.querySelector<HTMLInputElement>("input[type=file]");
  const list = form.querySelector<HTMLElement>("[data-upload-list]");
  const summary = form.querySelector<HTMLElement>("[data-upload-summary]");
  if (input === null || list === null || summary === null) {
    return;
  }
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void upload(form, input, list, summary);
  });
  const zone = form.querySelector<HTMLElement>("[data-upload-zone]");
  zone?.addEventListener("dragover", (event) => {
    event.preventDefault();
    zone.classList.add("is-over");
  });
  zone?.addEventListener("dragleave", () => {
    zone.classList.remove("is-over");
  });
  zone?.addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("is-over");
    if (event.dataTransfer !== null && event.dataTransfer.files.length > 0) {
      input.files = event.dataTransfer.files;
    }
  });
}

async function upload(
  form: HTMLFormElement,
  input: HTMLInputElement,
  list: HTMLElement,
  summary: HTMLElement,
): Promise<void> {
  const button = form.querySelector<HTMLButtonElement>("button[type=submit]");
  const entries = [...(input.files ?? [])].map((file) => addEntry(list, file));
  if (entries.length === 0 || button === null) {
    return;
  }
  button.disabled = true;
  const url = form.dataset["upload"] ?? "/api/v1/images";
  const fields = new FormData(form);
  fields.delete(input.name);
  const tell = (): void => {
    summary.textContent = summarise(entries);
    const isDone = entries.every((entry) => entry.result !== "waiting");
    if (isDone && entries.some((entry) => entry.result !== "failed")) {
      summary.append(" ", showThem());
      void listThem();
    }
  };
  tell();
  await eachAtMost(entries, AT_ONCE, async (entry) => {
    await sendEntry(url, fields, entry, tell);
  });
  button.disabled = false;
  input.value = "";
}

/** Put the new photographs and their count where the page shows them; the form stays as it is. */
async function listThem(): Promise<void> {
  const answer = await fetch(location.href);
  if (!answer.ok) {
    return; // what was sent is stored all the same; the page shows it when it is next loaded
  }
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
  for (const part of ["[data-after-upload]", ".page-head"]) {
    const now = fresh.querySelector(part);
    if (now !== null) {
      document.querySelector(part)?.replaceWith(now);
    }
  }
}

/** A link to the list, which stands far above the form on a narrow screen. */
function showThem(): HTMLAnchorElement {
  const link = document.createElement("a");
  link.href = "#images";
  link.textContent = "Show them";
  return link;
}

async function sendEntry(
  url: string,
  fields: FormData,
  entry: Entry,
  tell: () => void,
): Promise<void> {
  const body = new FormData();
  for (const [name, value] of fields) {
    body.append(name, value);
  }
  body.append("file", entry.file);
  entry.result = "waiting";
  entry.bar.hidden = false;
  entry.state.className = "muted small";
  entry.state.textContent = "Sending";
  try {
    entry.result = await sendFile(url, body, (share) => {
      entry.bar.value = share;
    });
    entry.bar.value = 1;
    entry.state.textContent = entry.result === "stored" ? "Stored" : "Already here";
  } catch (error) {
    entry.result = "failed";
    entry.bar.hidden = true;
    entry.state.className = "field__error";
    entry.state.textContent = explain(error);
    if (lacksTime(error)) {
      entry.state.textContent =
        "Neither EXIF nor the file's name tells when it was taken. Say it here, or give the " +
        "camera a pattern of file names (Edit). For many: Import folders and zips.";
      entry.item.append(
        timeQuestion(entry.file.name, (moment) => {
          void sendEntry(url, withTime(fields, moment), entry, tell);
        }),
      );
    }
  }
  tell();
}

function withTime(fields: FormData, moment: string): FormData {
  const more = new FormData();
  for (const [name, value] of fields) {
    more.append(name, value);
  }
  more.set("captured_at", moment);
  return more;
}

function addEntry(list: HTMLElement, file: File): Entry {
  const item = document.createElement("li");
  item.className = "upload-item";
  const name = document.createElement("span");
  name.className = "upload-item__name";
  name.textContent = file.name;
  const state = document.createElement("span");
  state.className = "muted small";
  state.textContent = "Waiting";
  const bar = document.createElement("progress");
  bar.max = 1;
  bar.value = 0;
  bar.setAttribute("aria-label", `${file.name}, share sent`);
  item.append(name, state, bar);
  list.append(item);
  return { file, item, bar, state, result: "waiting" };
}

function summarise(entries: readonly Entry[]): string {
  const count = (result: Entry["result"]): number =>
    entries.filter((entry) => entry.result === result).length;
  const done = entries.length - count("waiting");
  const parts = [`${number(done)} of ${number(entries.length)} done`];
  if (count("known") > 0) {
    parts.push(`${number(count("known"))} already here`);
  }
  if (count("failed") > 0) {
    parts.push(`${number(count("failed"))} refused, see below`);
  }
  return parts.join(", ");
}
