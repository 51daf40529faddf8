/** Asks for the moment of a photograph that does not tell it itself, right where it was refused. */
import { ApiProblem } from "../api";

let asked = 0;

/** Whether a photograph was refused because nothing says when it was taken. */
export function lacksTime(error: unknown): boolean {
  return error instanceof ApiProblem && error.fields.some(({ field }) => field === "captured_at");
}

/** A field and a button; `answer` gets the moment as the camera's zone has it, without an offset. */
export function timeQuestion(fileName: string, answer: (moment: string) => void): HTMLElement {
  asked += 1;
  const row = document.createElement("div");
  row.className = "upload-item__time";
  const label = document.createElement("label");
  label.className = "small";
  label.htmlFor = `taken-at-${String(asked)}`;
  label.textContent = "Taken at, in the camera's time zone";
  const field = document.createElement("input");
  field.id = label.htmlFor;
  field.type = "datetime-local";
  field.step = "1";
  field.className = "input";
  const button = document.createElement("button");
  button.type = "button";
  button.className = "button button--small";
  button.textContent = "Send with this time";
  button.setAttribute("aria-label", `Send ${fileName} with this time`);
  button.addEventListener("click", () => {
    if (field.value === "") {
      field.focus();
      return;
    }
    row.remove();
    answer(field.value);
  });
  row.append(label, field, button);
  return row;
}
