/** What can be done while reviewing, and the keys it stands on at first. */
import type { Command } from "./modes";
import type { Grade } from "./pose";

export const REVIEW_COMMANDS: readonly Command[] = [
  { id: "review.good", codes: ["Digit1", "Numpad1"], meaning: "Good" },
  { id: "review.ok", codes: ["Digit2", "Numpad2"], meaning: "OK" },
  { id: "review.bad", codes: ["Digit3", "Numpad3"], meaning: "Bad" },
  { id: "review.wrong", codes: ["Digit4", "Numpad4"], meaning: "Wrong match" },
  {
    id: "review.rest-good",
    codes: ["Digit1"],
    shift: "with",
    meaning: "The rest of the image is Good",
  },
  { id: "review.undo", codes: ["Backspace"], meaning: "Undo the last decision" },
  { id: "review.next-box", codes: ["KeyJ"], repeats: true, meaning: "Next box" },
  { id: "review.previous-box", codes: ["KeyK"], repeats: true, meaning: "Previous box" },
  { id: "review.next-image", codes: ["KeyL"], repeats: true, meaning: "Next image" },
  { id: "review.previous-image", codes: ["KeyH"], repeats: true, meaning: "Previous image" },
  { id: "review.next-ungraded", codes: ["KeyN"], meaning: "Next to be graded" },
  { id: "review.complete", codes: ["Enter"], meaning: "Image complete: all vessels accounted for" },
  { id: "review.peek", codes: ["Space"], meaning: "Hold: the photograph alone" },
  { id: "review.fit", codes: ["KeyZ"], meaning: "Fit the box or the whole image" },
  { id: "review.layers", codes: ["KeyV"], meaning: "Layers" },
  { id: "review.missed", codes: ["KeyM"], meaning: "Mark a missed vessel" },
  { id: "review.edit", codes: ["KeyE"], meaning: "Correct the box" },
  { id: "review.rematch", codes: ["KeyR"], meaning: "Match with another vessel" },
  { id: "review.comment", codes: ["KeyC"], meaning: "Comment" },
  { id: "review.guideline", codes: ["KeyG"], meaning: "Guideline, with pictures" },
  { id: "review.figures", codes: ["KeyS"], meaning: "Figures of the run" },
  { id: "review.bookmark", codes: ["KeyB"], meaning: "Bookmark" },
];

/** The reason chips by their place from the left. */
export const REASON_COMMANDS: readonly Command[] = ["KeyQ", "KeyW", "KeyT", "KeyY", "KeyU"].map(
  (code, i) => ({
    id: `reasons.${i + 1}`,
    codes: [code],
    meaning: `Reason ${i + 1} of the decision just made`,
  }),
);

export const GRADE_COMMANDS: ReadonlyMap<string, Grade> = new Map<string, Grade>([
  ["review.good", "good"],
  ["review.ok", "ok"],
  ["review.bad", "bad"],
  ["review.wrong", "wrong"],
]);
