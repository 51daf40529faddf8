/** Brings what lies around the poses of an image onto the photograph and the map, when it is here. */
import { horizonOf } from "../geometry/horizon";
import { SurroundingsOverlay } from "../viewer/overlay/surroundings-overlay";
import type { Viewer } from "../viewer/viewer";
import { correctionOf } from "./correction";
import type { FactsPanel } from "./facts-panel";
import { drawMap } from "./map/place-map";
import { loadTrack, type TrackPoint } from "./map/track";
import { points, type Pose } from "./pose";
import { nameOf } from "./rematch/candidates";
import type { Scene } from "./stage";
import {
  NOTHING_AROUND,
  worldCamera,
  type RunCamera,
  type SurroundingsStore,
} from "./surroundings";
import { MISSED_WORDS, outcomeInWords } from "./words";
import type { VesselId } from "../vessel-id";

/** Only who looks this long gets it: a reviewer in full flight needs the network for photographs. */
const LINGER_MS = 150;

export class SurroundingsView {
  private readonly overlay = new SurroundingsOverlay();
  private readonly tracks = new Map<string, readonly TrackPoint[]>();
  private camera: RunCamera | null = null;
  private horizon: ReturnType<typeof horizonOf> | null = null;
  private scene: Scene | null = null;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private loading: AbortController | null = null;

  constructor(
    viewer: Viewer,
    private readonly panel: FactsPanel,
    private readonly store: SurroundingsStore,
  ) {
    this.requestRender = () => {
      viewer.requestRender();
    };
    viewer.add(this.overlay);
  }

  private readonly requestRender: () => void;

  /** Shows what is known already and asks for the rest a moment later. */
  show(scene: Scene): void {
    this.scene = scene;
    this.draw(scene);
    if (this.timer !== null) {
      clearTimeout(this.timer);
    }
    this.loading?.abort();
    this.timer = setTimeout(() => {
      this.loading = new AbortController();
      void this.load(scene, this.loading.signal);
    }, LINGER_MS);
  }

  private async load(scene: Scene, signal: AbortSignal): Promise<void> {
    const { image, pose } = scene;
    await Promise.allSettled([
      this.store.of(image.id) ?? this.store.load(image.id, signal),
      this.store.camera().then((camera) => {
        this.camera = camera;
        this.horizon ??= horizon(camera);
      }),
      pose === null ? null : this.loadTrack(pose),
    ]);
    // What did not come is not drawn; it is asked for again when the image is looked at again.
    if (this.scene === scene) {
      this.draw(scene);
    }
  }

  private async loadTrack(pose: Pose): Promise<void> {
    const key = trackKey(pose);
    if (!this.tracks.has(key)) {
      this.tracks.set(key, await loadTrack(mmsiOf(pose), pose.image.captured_at));
    }
  }

  private draw(scene: Scene): void {
    const { vessels, missed } = this.store.of(scene.image.id) ?? NOTHING_AROUND;
    this.overlay.set({
      vessels: vessels
        .filter((vessel) => vessel.pose_id === null)
        .map((vessel) => ({
          words: `${nameOf(vessel)}: ${outcomeInWords(vessel.outcome)}`,
          segment: points(vessel.segments.dead_reckoned),
        }))
        .filter(({ segment }) => segment.length > 0),
      missed: missed.map((vessel) => ({
        id: vessel.id,
        rect: { x1: vessel.x1_px, y1: vessel.y1_px, x2: vessel.x2_px, y2: vessel.y2_px },
        words: MISSED_WORDS[vessel.reason],
      })),
      horizon: this.horizon ?? [],
    });
    this.requestRender();
    this.drawMap(scene);
  }

  private drawMap({ pose, image }: Scene): void {
    if (pose === null || this.camera === null) {
      this.panel.showMap(null);
      return;
    }
    const track = this.tracks.get(trackKey(pose)) ?? [];
    this.panel.showMap(drawMap({ camera: this.camera, pose, track, at: image.captured_at }));
  }
}

function horizon(camera: RunCamera): ReturnType<typeof horizonOf> {
  const [, , up = 0] = camera.center_in_enu_m;
  // The plane of the water lies at z = level - origin in the site's frame.
  return horizonOf(worldCamera(camera), up - (camera.water_level_m - camera.origin.height_m));
}

function mmsiOf(pose: Pose): VesselId {
  return correctionOf(pose)?.mmsi ?? pose.vessel.mmsi;
}

function trackKey(pose: Pose): string {
  return `${mmsiOf(pose)} ${pose.image.captured_at}`;
}
