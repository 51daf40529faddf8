/** The island of drawing boxes: ground truth in two dimensions, by people. */
import { DrawingScreen } from "./boxes/drawing-screen";

const root = document.querySelector<HTMLElement>("[data-boxes]");
if (root !== null) {
  void new DrawingScreen(root).open(Number(root.dataset["image"]));
}
