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
  about: MovedJson;
  readonly flags: ReadonlySet<string>;
}

/** So long what came live is kept apart, for chunks that were asked for before it came. */
const RECENT = 40;
const PER_DEGREE = 1e-5;
const NAMES = ["t", "x", "y", "sog", "cog", "heading"] as const;

export class TrackStore {
  tracks: readonly Track[] = [];
  silenceS = 600;
  private chunkS = 600;
  private readonly chunks = new Map<number, Map<string, Track>>();
  private recent: StretchJson[] = [];

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
    for (const news of this.recent) {
      this.putIn(news);
    }
    this.join();
  }

  /** Takes what came live, of `chunkS` seconds a chunk; what is there already is not taken twice. */
  append(news: StretchJson, chunkS: number): void {
    this.chunkS = chunkS;
    this.recent = [...this.recent, news].slice(-RECENT);
    this.putIn(news);
    const known = new Map(this.tracks.map((track) => [String(track.id), track]));
    const startS = Date.parse(news.start) / 1000;
    const fresh: Track[] = [];
    for (const moved of news.vessels) {
      const track = unpacked(moved, startS);
      const own = known.get(String(moved.mmsi));
      if (own === undefined) {
        fresh.push(track);
      } else {
        put(own, track);
      }
    }
    if (fresh.length > 0) {
      this.tracks = [...this.tracks, ...fresh];
    }
  }

  private putIn(news: StretchJson): void {
    const startS = Date.parse(news.start) / 1000;
    for (const moved of news.vessels) {
      const track = unpacked(moved, startS);
      track.t.forEach((seconds, index) => {
        const own = this.chunks.get(Math.floor(seconds / this.chunkS));
        if (own === undefined) {
          return; // not loaded yet: it will come with its chunk
        }
        const known = own.get(String(moved.mmsi));
        if (known === undefined) {
          own.set(String(moved.mmsi), pointOf(track, index));
        } else {
          known.about = moved;
          insert(known, track, index);
        }
      });
    }
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
    this.recent = [];
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

function pointOf(track: Track, index: number): Track {
  const point = Object.fromEntries(
    NAMES.map((name) => [name, track[name].slice(index, index + 1)]),
  ) as unknown as Points;
  return { ...point, id: track.id, about: track.about, flags: track.flags };
}

function put(into: Track, from: Track): void {
  into.about = from.about;
  from.t.forEach((_, index) => {
    insert(into, from, index);
  });
}

/** Puts a point of one track into another, by its time, unless there is one of that time. */
function insert(into: Points, from: Points, index: number): void {
  const seconds = from.t[index] ?? 0;
  let at = into.t.length;
  while (at > 0 && (into.t[at - 1] ?? 0) >= seconds) {
    at -= 1;
  }
  if (into.t[at] !== seconds) {
    for (const name of NAMES) {
      into[name].splice(at, 0, from[name][index] ?? 0);
    }
  }
}

function joined(parts: readonly Track[]): readonly Track[] {
  const last = parts[parts.length - 1];
  if (last === undefined) {
    return [];
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
