/**
 * The map: landmarks of the site, the keypoints of this viewport, the camera and what it sees.
 *
 * Leaflet moves and zooms; tiles come only when the installation names a server for them. Without,
 * the grid of local metres is the map. A click gives a keypoint its place.
 */
import "leaflet/dist/leaflet.css";
import L from "leaflet";
import type { Geodetic } from "../../geometry/geodesy";
import type { Vec3 } from "../../geometry/vectors";
import type { Change, Editor } from "../editor";
import { placeLabels, widthOf, type Side } from "../labels";
import type { Point } from "../model/point";
import { LocalGrid } from "./local-grid";
import { viewCone } from "./view-cone";

export interface Tiles {
  readonly url: string;
  readonly attribution: string;
}

const CLOSEST = 21;
const NEAR_M = 400;
/** Room for names beside the outermost marks. */
const NAMES_PX = 110;

interface Mark {
  readonly place: Geodetic;
  readonly name: string;
  readonly className: string;
  readonly isFirst: boolean;
  readonly onClick: () => void;
}

export class MapPane {
  private readonly map: L.Map;
  private readonly landmarks = L.layerGroup();
  private readonly camera = L.layerGroup();
  private isFramed = false;

  constructor(
    surface: HTMLElement,
    private readonly editor: Editor,
    tiles: Tiles | null,
  ) {
    const { latDeg, lonDeg } = editor.world.frame.place;
    this.map = L.map(surface, {
      center: [latDeg, lonDeg],
      zoom: 15,
      maxZoom: CLOSEST,
      zoomSnap: 0.25,
      attributionControl: tiles !== null,
      zoomControl: false,
    });
    L.control.zoom({ position: "topright" }).addTo(this.map);
    if (tiles !== null) {
      this.map.attributionControl.setPrefix(false);
      const attribution = asHtml(tiles.attribution);
      L.tileLayer(tiles.url, { attribution, maxZoom: CLOSEST }).addTo(this.map);
    }
    L.control.scale({ imperial: false, position: "bottomright" }).addTo(this.map);
    const grid = new LocalGrid(this.map, editor.world.frame);
    this.camera.addTo(this.map);
    this.landmarks.addTo(this.map);
    this.map.on("click", (event) => {
      const { lat, lng } = event.latlng;
      editor.locate({ latDeg: lat, lonDeg: lng, heightM: editor.world.waterLevelM });
    });
    this.map.on("zoomend", () => {
      this.drawLandmarks(); // other names have room now
    });
    new ResizeObserver(() => {
      this.map.invalidateSize({ animate: false });
      this.frameOnce();
      grid.draw();
    }).observe(surface);
    editor.listen((changes) => {
      this.show(changes);
    });
    this.drawAll();
    grid.draw();
  }

  /** Shows everything that is known: camera, keypoints, landmarks. */
  frameAll(): void {
    const { points, landmarks, figures, world } = this.editor;
    const places = [...points, ...landmarks].flatMap(({ place }) => (place === null ? [] : [at(place)]));
    if (figures !== null) {
      places.push(at(world.frame.geodetic(figures.camera.center)));
    }
    if (places.length > 0) {
      const room = this.map.getSize().x > 3 * NAMES_PX ? NAMES_PX : 20;
      this.map.fitBounds(L.latLngBounds(places), {
        animate: false,
        maxZoom: 18,
        paddingTopLeft: [40, 40],
        paddingBottomRight: [room, 50],
      });
    }
  }

  reveal(place: Geodetic): void {
    if (!this.map.getBounds().pad(-0.05).contains(at(place))) {
      this.map.panTo(at(place), { animate: false });
    }
  }

  private frameOnce(): void {
    if (!this.isFramed && this.map.getSize().x > 0 && this.editor.landmarks.length + this.editor.points.length > 0) {
      this.isFramed = true;
      this.frameAll();
    }
  }

  private show(changes: ReadonlySet<Change>): void {
    const isMoving = this.editor.isDragging;
    if (!isMoving && (["points", "selection", "landmarks", "answer"] as const).some((change) => changes.has(change))) {
      this.drawLandmarks();
    }
    if (changes.has("figures") || changes.has("selection")) {
      this.drawCamera();
    }
    this.frameOnce();
  }

  private drawAll(): void {
    this.drawLandmarks();
    this.drawCamera();
    this.frameOnce();
  }

  private drawLandmarks(): void {
    const { points, landmarks, selectedKey, armed } = this.editor;
    this.landmarks.clearLayers();
    const placed = new Set(points.map(({ landmarkId }) => landmarkId));
    const marks: Mark[] = points.flatMap((point) => {
      const isFirst = point.key === selectedKey;
      const onClick = (): void => {
        this.choose(point);
      };
      const className = this.classOf(point, isFirst);
      return point.place === null ? [] : [{ place: point.place, name: point.name, className, isFirst, onClick }];
    });
    for (const landmark of landmarks.filter(({ id }) => !placed.has(id))) {
      const isFirst = landmark.id === armed?.id;
      const className = `map-landmark${isFirst ? " is-selected" : ""}`;
      const onClick = (): void => {
        this.editor.pick(landmark);
      };
      marks.push({ place: landmark.place, name: landmark.name, className, isFirst, onClick });
    }
    this.drawMarks(marks.sort((a, b) => Number(b.isFirst) - Number(a.isFirst)));
  }

  private drawMarks(marks: readonly Mark[]): void {
    const labels = marks.map(({ place, name }) => {
      const { x, y } = this.map.latLngToContainerPoint(at(place));
      return { x, y, width: widthOf(name) };
    });
    placeLabels(labels, this.map.getSize().x).forEach((side, index) => {
      const mark = marks[index];
      if (mark !== undefined) {
        this.mark(mark, side);
      }
    });
  }

  private choose(point: Point): void {
    const landmark = this.editor.landmarks.find(({ id }) => id === point.landmarkId);
    if (landmark === undefined || point.pixel !== null) {
      this.editor.select(point.key);
    } else {
      this.editor.pick(landmark);
    }
  }

  private classOf(point: Point, isSelected: boolean): string {
    const outlier = this.editor.figures?.outliers.has(point.key) === true;
    return [
      "map-keypoint",
      `is-${point.role}`,
      isSelected ? "is-selected" : "",
      outlier ? "is-outlier" : "",
      point.pixel === null ? "is-waiting" : "",
    ].join(" ");
  }

  private mark({ place, name, className, isFirst, onClick }: Mark, side: Side): void {
    const radius = isFirst ? 8 : 6;
    const label = document.createElement("span");
    label.textContent = name;
    L.circleMarker(at(place), { className, radius, bubblingMouseEvents: false })
      .bindTooltip(label, {
        permanent: side !== null,
        direction: side ?? "top",
        offset: side === null ? [0, -6] : [side === "left" ? -6 : 6, 0],
        className: "map-name",
      })
      .on("click", onClick)
      .addTo(this.landmarks);
  }

  private drawCamera(): void {
    const { figures, world, answer, selected } = this.editor;
    this.camera.clearLayers();
    if (figures === null) {
      return;
    }
    const { frame } = world;
    const place = (point: Vec3): L.LatLngTuple => at(frame.geodetic(point));
    const cone = viewCone(figures.camera, this.reach());
    if (cone.length > 0) {
      L.polygon(cone.map(place), { className: "map-cone", interactive: false }).addTo(this.camera);
    }
    const center = place(figures.camera.center);
    const sigma = answer?.camera?.center_sigma_m ?? null;
    if (sigma !== null) {
      // Two sigmas of the worse horizontal axis: where the camera very likely stands.
      const radius = 2 * Math.max(sigma[0], sigma[1]);
      L.circle(center, { radius, className: "map-unsure", interactive: false }).addTo(this.camera);
    }
    const target = selected?.place ?? null;
    if (target !== null) {
      L.polyline([center, at(target)], { className: "map-sight", interactive: false }).addTo(this.camera);
    }
    const label = document.createElement("span");
    label.textContent = "Camera";
    L.circleMarker(center, { radius: 7, className: "map-camera", interactive: false })
      .bindTooltip(label, { permanent: true, direction: "bottom", offset: [0, 6], className: "map-name map-name--camera" })
      .addTo(this.camera);
  }

  /** As far as the farthest keypoint, and a little more. */
  private reach(): number {
    const { figures, world, points } = this.editor;
    const [x, y] = figures?.camera.center ?? [0, 0];
    const away = points.flatMap(({ place }) => {
      if (place === null) {
        return [];
      }
      const [east, north] = world.frame.position(place);
      return [Math.hypot(east - x, north - y)];
    });
    return 1.1 * Math.max(NEAR_M, ...away);
  }
}

/** Leaflet takes markup there; a setting is text. */
function asHtml(text: string): string {
  const span = document.createElement("span");
  span.textContent = text;
  return span.innerHTML;
}

function at({ latDeg, lonDeg }: Geodetic): L.LatLngTuple {
  return [latDeg, lonDeg];
}
