/**
 * Tracks as the map draws them: for each vessel lists of moments and places, oldest first.
 *
 * They arrive in chunks of time, in any order. A step longer than the longest silence is a gap, over
 * which nothing is drawn and nothing is guessed.
 */

/** As the server tells it (GET /sites/{id}/ais/tracks). */
export interface StretchJson {
  readonly start: string;
  readonly longest_silence_s: number;
  readonly vessels: readonly MovedJson[];
}

export interface MovedJson {
  readonly mmsi: number | string;
  readonly name: string | null;
  readonly ship_type: string | null;
  readonly ais_class: string | null;
  readonly length_m: number | null;
  readonly width_m: number | null;
  readonly flags: readonly string[];
  readonly t: readonly number[];
  readonly lat: readonly number[];
  readonly lon: readonly number[];
  readonly sog: readonly number[];
  readonly cog: readonly number[];
  readonly heading: readonly number[];
}

/** Lists of the same length; x and y are of the whole world in [0, 1], as web maps have it. */
export interface Points {
  readonly t: number[];
  readonly x: number[];
  readonly y: number[];
  readonly sog: number[];
  readonly cog: number[];
  readonly heading: number[];
}

export interface Track extends Points {
  readonly id: number | string;
  readonly about: MovedJson;
  readonly flags: ReadonlySet<string>;
}

const PER_DEGREE = 1e-5;
const NAMES = ["t", "x", "y", "sog", "cog", "heading"] as const;

export class TrackStore {
  tracks: readonly Track[] = [];
  silenceS = 600;
  private readonly chunks = new Map<number, ReadonlyMap<string, Track>>();

  has(chunk: number): boolean {
    return this.chunks.has(chunk);
  }

  /** Takes a chunk; `chunk` is its place in time, by which chunks are put in order. */
  add(chunk: number, stretch: StretchJson): void {
    this.silenceS = stretch.longest_silence_s;
    const startS = Date.parse(stretch.start) / 1000;
    this.chunks.set(
      chunk,
      new Map(stretch.vessels.map((moved) => [String(moved.mmsi), unpacked(moved, startS)])),
    );
    this.join();
  }

  /** Forgets all chunks but these. */
  keep(wanted: ReadonlySet<number>): void {
    for (const chunk of this.chunks.keys()) {
      if (!wanted.has(chunk)) {
        this.chunks.delete(chunk);
      }
    }
  }

  clear(): void {
    this.chunks.clear();
  }

  find(id: string): Track | undefined {
    return this.tracks.find((track) => String(track.id) === id);
  }

  private join(): void {
    const parts = new Map<string, Track[]>();
    for (const [, tracks] of [...this.chunks].sort(([a], [b]) => a - b)) {
      for (const [id, track] of tracks) {
        const own = parts.get(id);
        if (own === undefined) {
          parts.set(id, [track]);
        } else {
          own.push(track);
        }
      }
    }
    this.tracks = [...parts.values()].flatMap((own) => joined(own));
  }
}

function joined(parts: readonly Track[]): readonly Track[] {
  const last = parts[parts.length - 1];
  if (last === undefined || parts.length === 1) {
    return parts;
  }
  const points = Object.fromEntries(
    NAMES.map((name) => [name, parts.flatMap((part) => part[name])]),
  ) as unknown as Points;
  const flags = new Set(parts.flatMap((part) => [...part.flags]));
  return [{ ...points, id: last.id, about: last.about, flags }];
}

function unpacked(moved: MovedJson, startS: number): Track {
  return {
    id: moved.mmsi,
    about: moved,
    flags: new Set(moved.flags),
    t: summed(moved.t).map((seconds) => startS + seconds),
    x: summed(moved.lon).map((lon) => worldX(lon * PER_DEGREE)),
    y: summed(moved.lat).map((lat) => worldY(lat * PER_DEGREE)),
    sog: [...moved.sog],
    cog: [...moved.cog],
    heading: [...moved.heading],
  };
}

function summed(steps: readonly number[]): number[] {
  let sum = 0;
  return steps.map((step) => (sum += step));
}

export function worldX(lonDeg: number): number {
  return lonDeg / 360 + 0.5;
}

export function worldY(latDeg: number): number {
  const sine = Math.sin((latDeg * Math.PI) / 180);
  return 0.5 - Math.log((1 + sine) / (1 - sine)) / (4 * Math.PI);
}

export function lonOf(x: number): number {
  return (x - 0.5) * 360;
}

export function latOf(y: number): number {
  return (Math.atan(Math.sinh((0.5 - y) * 2 * Math.PI)) * 180) / Math.PI;
}
