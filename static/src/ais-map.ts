/** The island of a site's map: traffic at a moment, moved by a slider. */
import "./styles/traffic.css";
import { explain } from "./api";
import { MapScreen } from "./ais-map/map-screen";
import { showFlash } from "./page/flashes";

const root = document.querySelector<HTMLElement>("[data-traffic]");
if (root !== null) {
  new MapScreen(root).begin().catch((error: unknown) => {
    showFlash(`What the cameras look at could not be loaded. ${explain(error)}`, "error");
  });
}
