/**
 * A grid of metres east and north of the site's origin: the map when there are no tiles, and a
 * ruler when there are.
 */
import L from "leaflet";
import type { EnuFrame } from "../../geometry/geodesy";

const APART_PX = 90;
const SCALE_PX = 130;
const STEPS = [1, 2, 5, 10];

export class LocalGrid {
  private readonly layer = L.layerGroup();

  constructor(
    private readonly map: L.Map,
    private readonly frame: EnuFrame,
  ) {
    this.layer.addTo(map);
    map.on("moveend zoomend resize", () => {
      this.draw();
    });
  }

  draw(): void {
    this.layer.clearLayers();
    const bounds = this.map.getBounds();
    const { x: width } = this.map.getSize();
    const west = this.metres(bounds.getSouthWest());
    const east = this.metres(bounds.getNorthEast());
    const step = stepFor(((east[0] - west[0]) / width) * APART_PX);
    if (!Number.isFinite(step) || width === 0) {
      return;
    }
    for (let x = Math.ceil(west[0] / step) * step; x <= east[0]; x += step) {
      this.line([x, west[1]], [x, east[1]], x === 0);
      if (((east[0] - x) / (east[0] - west[0])) * width < SCALE_PX) {
        continue; // the scale stands there
      }
      this.label([x, west[1]], metresText(x, "E", "W"), "map-grid__label map-grid__label--east");
    }
    for (let y = Math.ceil(west[1] / step) * step; y <= east[1]; y += step) {
      this.line([west[0], y], [east[0], y], y === 0);
      this.label([west[0], y], metresText(y, "N", "S"), "map-grid__label map-grid__label--north");
    }
  }

  private metres(at: L.LatLng): readonly [number, number] {
    const place = { latDeg: at.lat, lonDeg: at.lng, heightM: this.frame.place.heightM };
    const [east, north] = this.frame.position(place);
    return [east, north];
  }

  private line(from: readonly [number, number], to: readonly [number, number], isAxis: boolean): void {
    const className = isAxis ? "map-grid map-grid--axis" : "map-grid";
    L.polyline([this.at(from), this.at(to)], { className, interactive: false }).addTo(this.layer);
  }

  private label(at: readonly [number, number], text: string, className: string): void {
    const words = document.createElement("span");
    words.textContent = text;
    const icon = L.divIcon({ html: words, className, iconSize: [0, 0] });
    L.marker(this.at(at), { icon, interactive: false, keyboard: false }).addTo(this.layer);
  }

  private at([east, north]: readonly [number, number]): L.LatLngTuple {
    const { latDeg, lonDeg } = this.frame.geodetic([east, north, 0]);
    return [latDeg, lonDeg];
  }
}

/** The next round number of metres: 1, 2 or 5 times a power of ten. */
export function stepFor(metres: number): number {
  const power = 10 ** Math.floor(Math.log10(metres));
  return power * (STEPS.find((step) => step * power >= metres) ?? 10);
}

export function metresText(metres: number, positive: string, negative: string): string {
  if (metres === 0) {
    return "0";
  }
  const size = Math.abs(metres);
  const text = size >= 10_000 ? `${size / 1000} km` : `${Number(size.toFixed(3))} m`;
  return `${text} ${metres < 0 ? negative : positive}`;
}
