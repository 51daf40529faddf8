/** The screen: map, clock, traffic and panel put together, and its state kept in the address. */
import "leaflet/dist/leaflet.css";
import L from "leaflet";
import { call, explain } from "../api";
import { EnuFrame } from "../geometry/geodesy";
import { part } from "../page/parts";
import { LocalGrid } from "../register/map/local-grid";
import { readAddress, writeAddress } from "./address";
import { CHUNK_S, Chunks } from "./chunks";
import { Clock } from "./clock";
import { Follower } from "./follower";
import { TimeBar } from "./time-bar";
import { latOf, lonOf, TrackStore, type Track } from "./track-store";
import { TrafficLayer } from "./traffic-layer";
import { VesselPanel } from "./vessel-panel";

const AROUND_ZOOM = 13;
const CLOSEST = 19;
const LIST_MS = 500;
const SETTLE_MS = 400;
/** So far ahead tracks are wanted: as long as a silence, and half a minute of play. */
const AHEAD_S = 600;
/** Class B and who lies at anchor report every three minutes. */
const QUIET_S = 200;
/** What an ended chunk still gets from slow receivers, before it is loaded again, thinned and judged. */
const LATE_S = 30;
const EQUATOR_M_PER_PX = 156_543;

interface FieldOfView {
  readonly name: string;
  readonly camera: string;
  readonly valid_from: string | null;
  readonly valid_until: string | null;
  readonly lat_deg: readonly number[];
  readonly lon_deg: readonly number[];
}

export class MapScreen {
  private readonly map: L.Map;
  private readonly store = new TrackStore();
  private readonly chunks: Chunks;
  private readonly clock: Clock;
  private readonly bar: TimeBar;
  private readonly layer: TrafficLayer;
  private readonly panel: VesselPanel;
  private readonly follower: Follower;
  private readonly fields = L.layerGroup();
  private views: readonly FieldOfView[] = [];
  private wanted: string | null;
  private settling: number | undefined;
  private listedMs = 0;
  private askedFor = "";
  private shownFields = "";
  private renewedChunk = 0;

  constructor(private readonly root: HTMLElement) {
    const { dataset } = root;
    const site: L.LatLngTuple = [Number(dataset["lat"]), Number(dataset["lon"])];
    const state = readAddress(location.search);
    this.wanted = state.vessel;
    this.map = L.map(part(root, "map"), {
      center: site,
      zoom: AROUND_ZOOM,
      maxZoom: CLOSEST,
      zoomSnap: 0.5,
      zoomAnimation: false,
      attributionControl: dataset["tileUrl"] !== "",
    });
    this.furnish(site, dataset);
    if (state.box !== null) {
      const [west, south, east, north] = state.box;
      this.map.fitBounds([[south, west], [north, east]], { animate: false });
    }
    this.chunks = new Chunks(
      Number(dataset["site"]),
      this.store,
      () => {
        this.loaded();
      },
      (error) => {
        this.say(`Tracks could not be loaded. ${explain(error)}`);
      },
    );
    const last = Date.parse(dataset["last"] ?? "") / 1000;
    const moment = state.momentS ?? (Number.isNaN(last) ? Date.now() / 1000 : last);
    this.clock = new Clock(moment, state.windowS, () => { this.show(); }, () => { this.settle(); });
    this.follower = new Follower(Number(dataset["site"]), {
      scope: () => this.chunks.loaded,
      moveTo: (momentS) => { this.clock.follow(momentS); },
      begin: () => { this.chunks.reload(); },
      take: (news) => {
        this.store.append(news, CHUNK_S);
        this.layer.changedInPart();
      },
      say: (words) => { this.tellLive(words); },
    });
    this.bar = new TimeBar(root, this.clock, dataset["timezone"] ?? "UTC");
    this.layer = new TrafficLayer(this.map, this.store);
    this.panel = new VesselPanel(root, (track) => { this.choose(track); });
    this.map.on("moveend", () => {
      this.look();
      this.settle();
    });
    root.querySelector("[data-act=follow]")?.addEventListener("click", () => {
      this.follow(!this.follower.isOn);
    });
    document.addEventListener("keydown", (event) => {
      const isTyping = (event.target as HTMLElement).closest("input:not([type=range]), select, textarea") !== null;
      if (event.code === "KeyL" && !isTyping && !event.ctrlKey && !event.altKey && !event.metaKey) {
        this.follow(!this.follower.isOn);
      }
    });
    this.map.on("click", (event) => {
      this.choose(this.layer.hit(event.containerPoint));
    });
    new ResizeObserver(() => { this.map.invalidateSize({ animate: false }); }).observe(part(root, "map"));
  }

  async begin(): Promise<void> {
    this.look();
    this.show();
    if (readAddress(location.search).isLive) {
      this.follow(true);
    }
    const found = await call(`/api/v1/sites/${this.root.dataset["site"] ?? ""}/fields-of-view`);
    this.views = (found as { readonly items: readonly FieldOfView[] }).items;
    this.drawFields();
  }

  private follow(isWanted: boolean): void {
    if (this.root.querySelector("[data-act=follow]") === null) {
      return; // no feed to follow
    }
    if (isWanted) {
      this.renewedChunk = 0;
      this.follower.start();
    } else {
      this.follower.stop();
      this.clock.isLive = false;
    }
    this.layer.quietS = isWanted ? QUIET_S : 0;
    this.root.querySelector("[data-act=follow]")?.setAttribute("aria-pressed", String(isWanted));
    this.settle();
  }

  /** Any other moment than now ends it. */
  private stayLive(): void {
    if (!this.follower.isOn) {
      return;
    }
    if (!this.clock.isLive && this.renewedChunk !== 0) {
      this.follow(false);
      return;
    }
    const ended = Math.floor((this.clock.momentS - LATE_S) / CHUNK_S) - 1;
    if (this.renewedChunk !== 0 && ended > this.renewedChunk) {
      this.chunks.renew(ended);
    }
    this.renewedChunk = ended;
  }

  private tellLive(words: string): void {
    const place = part(this.root, "live");
    if (place.textContent !== words) {
      place.textContent = words;
    }
  }

  private furnish(site: L.LatLngTuple, { tileUrl = "", tileAttribution = "" }: DOMStringMap): void {
    if (tileUrl !== "") {
      const words = document.createElement("span");
      words.textContent = tileAttribution;
      this.map.attributionControl.setPrefix(false);
      L.tileLayer(tileUrl, { attribution: words.innerHTML, maxZoom: CLOSEST }).addTo(this.map);
    }
    L.control.scale({ imperial: false, position: "bottomright" }).addTo(this.map);
    new LocalGrid(this.map, new EnuFrame({ latDeg: site[0], lonDeg: site[1], heightM: 0 })).draw();
    this.fields.addTo(this.map);
  }

  private look(): void {
    const bounds = this.map.getBounds();
    const across = Math.cos((this.map.getCenter().lat * Math.PI) / 180);
    const metresPerPx = (EQUATOR_M_PER_PX * across) / 2 ** this.map.getZoom();
    this.chunks.look({
      box: [bounds.getWest(), bounds.getSouth(), bounds.getEast(), bounds.getNorth()],
      toleranceM: 2 ** Math.round(Math.log2(Math.max(1, metresPerPx))),
    });
  }

  private show(): void {
    const { clock } = this;
    this.stayLive();
    const ahead = AHEAD_S + (clock.isPlaying ? clock.speed * 15 : 0);
    this.chunks.need(clock.momentS, clock.windowS, Math.min(ahead, 3 * 3600));
    this.layer.show(clock.momentS, clock.windowS);
    this.bar.show();
    this.drawFields();
    if (performance.now() - this.listedMs > LIST_MS) {
      this.list();
    }
    if (!clock.isPlaying) {
      this.settle();
    }
  }

  private loaded(): void {
    this.say("");
    if (this.wanted !== null) {
      const track = this.store.find(this.wanted);
      this.layer.chosen = track ?? this.layer.chosen;
      this.wanted = track === undefined ? this.wanted : null;
    } else if (this.layer.chosen !== null) {
      this.layer.chosen = this.store.find(String(this.layer.chosen.id)) ?? this.layer.chosen;
    }
    this.layer.changed();
    this.list();
  }

  private choose(track: Track | null): void {
    this.wanted = null;
    this.layer.chosen = track;
    this.layer.changed();
    this.list();
    this.settle();
  }

  private list(): void {
    this.listedMs = performance.now();
    const bounds = this.map.getBounds();
    const { chosen, vesselsNow } = this.layer;
    const inSight = vesselsNow.filter(({ at }) => bounds.contains(placeOf(at)));
    this.panel.showList(inSight, chosen);
    this.panel.showChosen(chosen, vesselsNow.find(({ track }) => track === chosen));
    this.root.toggleAttribute("data-loading", this.chunks.isLoading);
  }

  /** The views that are valid at the moment. */
  private drawFields(): void {
    const moment = this.clock.momentS * 1000;
    const valid = this.views.filter(
      ({ valid_from: from, valid_until: until }) =>
        (from === null || Date.parse(from) <= moment) && (until === null || moment < Date.parse(until)),
    );
    const key = valid.map(({ camera, name }) => `${camera} ${name}`).join("|");
    if (key === this.shownFields) {
      return;
    }
    this.shownFields = key;
    this.fields.clearLayers();
    for (const view of valid) {
      const corners = view.lat_deg.map((lat, index): L.LatLngTuple => [lat, view.lon_deg[index] ?? 0]);
      const [camera] = corners;
      if (camera !== undefined) {
        const label = document.createElement("span");
        label.textContent = `${view.camera}, ${view.name}`;
        L.polygon(corners, { className: "map-cone", interactive: false }).addTo(this.fields);
        L.circleMarker(camera, { radius: 6, className: "map-camera", interactive: false })
          .bindTooltip(label, { permanent: true, direction: "bottom", offset: [0, 6], className: "map-name map-name--camera" })
          .addTo(this.fields);
      }
    }
  }

  /** Writes the address and the last list once things stand still. */
  private settle(): void {
    window.clearTimeout(this.settling);
    this.settling = window.setTimeout(() => {
      const bounds = this.map.getBounds();
      const { chosen } = this.layer;
      const address = writeAddress({
        momentS: this.clock.momentS,
        windowS: this.clock.windowS,
        box: [bounds.getWest(), bounds.getSouth(), bounds.getEast(), bounds.getNorth()],
        vessel: chosen === null ? this.wanted : String(chosen.id),
        isLive: this.follower.isOn,
      });
      if (address !== this.askedFor) {
        this.askedFor = address;
        history.replaceState(null, "", `${location.pathname}${address}`);
      }
      this.list();
      this.bar.show();
    }, SETTLE_MS);
  }

  private say(words: string): void {
    const status = part(this.root, "status");
    status.hidden = words === "";
    status.textContent = words;
  }
}

function placeOf({ x, y }: { readonly x: number; readonly y: number }): L.LatLngTuple {
  return [latOf(y), lonOf(x)];
}
