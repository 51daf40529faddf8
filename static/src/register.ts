/** The registration island: loads a viewport, then connects photograph, map, table and panels. */
import "./styles/register.css";
import { explain } from "./api";
import { EnuFrame } from "./geometry/geodesy";
import { showFlash } from "./page/flashes";
import { intrinsicsFrom, placeFrom, RegistrationApi, type IntrinsicsJson, type PlaceJson } from "./register/api";
import { Editor, type World } from "./register/editor";
import { RegisterScreen } from "./register/screen";

interface WorldJson {
  readonly origin: PlaceJson;
  readonly water_level_m: number;
  readonly intrinsics: IntrinsicsJson;
}

const root = document.querySelector<HTMLElement>("[data-register]");
if (root !== null) {
  open(root).catch((error: unknown) => {
    showFlash(`The editor could not be opened. ${explain(error)} Reload the page.`, "error");
  });
}

async function open(root: HTMLElement): Promise<void> {
  const viewportId = Number(root.dataset["viewport"]);
  const api = new RegistrationApi(viewportId, Number(root.dataset["site"]));
  const [saved, landmarks, images] = await Promise.all([
    api.keypoints(),
    api.landmarks(),
    api.images(viewportId),
  ]);
  const world = worldFrom(JSON.parse(root.dataset["world"] ?? "{}") as WorldJson);
  const editor = new Editor(world, root.dataset["mayEdit"] !== undefined, saved.points, saved.version);
  editor.landmarks = landmarks;
  await new RegisterScreen(root, editor, api, images).begin();
}

function worldFrom(json: WorldJson): World {
  return {
    frame: new EnuFrame(placeFrom(json.origin)),
    waterLevelM: json.water_level_m,
    intrinsics: intrinsicsFrom(json.intrinsics),
  };
}
