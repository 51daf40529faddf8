/**
 * What the registration editor asks the server, and the shapes of its answers.
 *
 * The solve answers with everything that is drawn (see app/registration): polylines are in pixels
 * of the image, (0, 0) the centre of the first one.
 */
import { call, callVersioned } from "../api";
import type { Intrinsics, Pixel } from "../geometry/camera";
import type { Distortion } from "../geometry/distortion";
import type { Geodetic } from "../geometry/geodesy";
import type { Mat3, Vec3 } from "../geometry/vectors";
import { fromJson, toJson, type CompletePoint, type KeypointJson, type Landmark, type Points } from "./model/point";

export interface PlaceJson {
  readonly lat_deg: number;
  readonly lon_deg: number;
  readonly height_m: number;
}

export interface IntrinsicsJson {
  readonly width_px: number;
  readonly height_px: number;
  readonly fx_px: number;
  readonly fy_px: number;
  readonly cx_px: number;
  readonly cy_px: number;
  readonly distortion: readonly number[];
}

export type Method = "pnp" | "homography_water" | "homography_pca";

export interface MethodPoint {
  readonly key: string;
  readonly u_px: number | null;
  readonly v_px: number | null;
  readonly du_px: number | null;
  readonly dv_px: number | null;
  readonly error_px: number | null;
  readonly leave_one_out_px: number | null;
  readonly is_used: boolean;
}

export interface MethodAnswer {
  readonly method: Method;
  readonly error: string | null;
  readonly mae_px: number | null;
  readonly mae_pct_width: number | null;
  readonly mae_pct_height: number | null;
  readonly leave_one_out_px: number | null;
  readonly check_mae_px: number | null;
  readonly points: readonly MethodPoint[];
  readonly warnings: readonly string[];
}

export interface CameraAnswer {
  readonly R_cam_from_enu: Mat3;
  readonly center: PlaceJson;
  readonly center_enu_m: Vec3;
  readonly center_sigma_m: Vec3 | null;
  readonly height_above_water_m: number;
  readonly heading_deg: number;
  readonly pitch_deg: number;
  readonly roll_deg: number;
  readonly intrinsics: IntrinsicsJson;
  readonly refined_from: IntrinsicsJson | null;
  readonly priors: { readonly pixel_px: number; readonly focal: number; readonly k1: number };
  readonly water_sigma_px: number | null;
  readonly water_sigma_range_m: number | null;
}

export type Polyline = readonly Pixel[];

export interface GridLine {
  readonly kind: "range" | "bearing";
  readonly label: string;
  readonly lines: readonly Polyline[];
  readonly at_px: Pixel | null;
}

export interface HeatMap {
  readonly columns: number;
  readonly rows: number;
  readonly cell_px: Pixel;
  readonly sigma_px: readonly (readonly (number | null)[])[];
}

export interface ProjectedLandmark {
  readonly landmark_id: number;
  readonly name: string;
  readonly u_px: number;
  readonly v_px: number;
  readonly range_m: number;
  readonly is_placed: boolean;
}

export interface NextPoint {
  readonly box_px: readonly [number, number, number, number];
  readonly sentence: string;
}

export interface ReadinessAnswer {
  readonly level: "too_few" | "refused" | "poor" | "fair" | "good";
  readonly control_points: number;
  readonly missing_for_solution: number;
  readonly missing_for_good: number;
  readonly sentences: readonly string[];
  readonly warnings: readonly string[];
  readonly next_point: NextPoint | null;
}

export interface Suspicion {
  readonly kind: string;
  readonly keys: readonly string[];
  readonly message: string;
}

export interface SolveAnswer {
  readonly methods: readonly MethodAnswer[];
  readonly suspicions: readonly Suspicion[];
  readonly camera: CameraAnswer | null;
  readonly horizon: { readonly lines: readonly Polyline[] } | null;
  readonly grid: readonly GridLine[];
  readonly heat_map: HeatMap | null;
  readonly landmarks: readonly ProjectedLandmark[];
  readonly readiness: ReadinessAnswer;
}

interface LandmarkJson extends PlaceJson {
  readonly id: number;
  readonly name: string;
  readonly viewport_count: number;
  readonly version: number;
}

export interface ImageJson {
  readonly id: number;
  readonly file_name: string;
  readonly captured_at: string;
  readonly width_px: number;
  readonly height_px: number;
  readonly file_url: string;
  readonly preview_url: string;
}

interface List<Item> {
  readonly items: readonly Item[];
  readonly next_cursor: string | null;
}

export function placeFrom(json: PlaceJson): Geodetic {
  return { latDeg: json.lat_deg, lonDeg: json.lon_deg, heightM: json.height_m };
}

export function intrinsicsFrom(json: IntrinsicsJson): Intrinsics {
  const [k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0] = json.distortion;
  const distortion: Distortion = [k1, k2, p1, p2, k3];
  return {
    widthPx: json.width_px,
    heightPx: json.height_px,
    fxPx: json.fx_px,
    fyPx: json.fy_px,
    cxPx: json.cx_px,
    cyPx: json.cy_px,
    distortion,
  };
}

export interface Saved {
  readonly points: Points;
  readonly version: number;
}

export class RegistrationApi {
  private readonly viewport: string;

  constructor(
    viewportId: number,
    private readonly siteId: number,
  ) {
    this.viewport = `/api/v1/viewports/${viewportId}`;
  }

  async keypoints(): Promise<Saved> {
    return savedFrom(await callVersioned(`${this.viewport}/keypoints`));
  }

  /** Replaces all keypoints; known landmarks move to the places given here. */
  async save(points: readonly CompletePoint[], version: number, key: string): Promise<Saved> {
    const answer = await callVersioned(`${this.viewport}/keypoints`, {
      method: "PUT",
      json: { keypoints: points.map(toJson), update_landmarks: true },
      ifMatch: version,
      idempotencyKey: key,
    });
    return savedFrom(answer);
  }

  async solve(points: readonly CompletePoint[], signal: AbortSignal): Promise<SolveAnswer> {
    const keypoints = points.map((point) => ({ ...toJson(point), key: point.key }));
    const json = { keypoints, overlays: true };
    return (await call(`${this.viewport}/solve`, { method: "POST", json, signal })) as SolveAnswer;
  }

  async register(method: Method, key: string): Promise<void> {
    const options = { method: "POST", json: { method }, idempotencyKey: key } as const;
    await call(`${this.viewport}/registrations`, options);
  }

  async landmarks(): Promise<Landmark[]> {
    const found = await all<LandmarkJson>(`/api/v1/sites/${this.siteId}/landmarks?limit=200`);
    return found.map((item) => ({
      id: item.id,
      name: item.name,
      place: placeFrom(item),
      viewportCount: item.viewport_count,
      version: item.version,
    }));
  }

  async rename(landmark: Landmark, name: string): Promise<void> {
    const url = `/api/v1/landmarks/${landmark.id}`;
    await call(url, { method: "PATCH", json: { name }, ifMatch: landmark.version });
  }

  async images(viewportId: number): Promise<ImageJson[]> {
    return all<ImageJson>(`/api/v1/images?viewport_id=${viewportId}&limit=200`, MOST_IMAGES);
  }
}

/** Landmarks are clicked on one photograph; nobody leafs through thousands for it. */
const MOST_IMAGES = 400;

async function all<Item>(url: string, most = 20_000): Promise<Item[]> {
  const items: Item[] = [];
  let cursor: string | null = null;
  do {
    const next: string = cursor === null ? url : `${url}&cursor=${encodeURIComponent(cursor)}`;
    const page = (await call(next)) as List<Item>;
    items.push(...page.items);
    cursor = page.next_cursor;
  } while (cursor !== null && items.length < most);
  return items;
}

function savedFrom(answer: { readonly body: unknown; readonly version: number | null }): Saved {
  const { items } = answer.body as List<KeypointJson>;
  return { points: items.map(fromJson), version: answer.version ?? 0 };
}
