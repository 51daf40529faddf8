/**
 * The matching cost in words. The paper's theta is a quotient: twice the distance of the centres,
 * the distance of the lower edges and the difference of the widths, each a share of the image,
 * together divided by the detection's score. Matching by likelihood tells instead how many sigmas
 * each is off, and how probable the vessel is for this detection.
 */

export interface CostPart {
  readonly name: string;
  readonly value: number;
}

export interface CostInWords {
  /** What is added up, as it counts. */
  readonly summands: readonly CostPart[];
  readonly dividedBy: CostPart | null;
  /** From 0 to 1: that the detection shows this vessel; null where matching does not say. */
  readonly probability: number | null;
}

const SUMMANDS: ReadonlyMap<string, readonly [name: string, factor: number]> = new Map([
  ["center_x", ["centre, twice", 2]],
  ["bottom", ["lower edge", 1]],
  ["width", ["width", 1]],
  ["middle_sigmas", ["middle, σ", 1]],
  ["bottom_sigmas", ["lower edge, σ", 1]],
  ["width_sigmas", ["width, σ", 1]],
  ["distance_m", ["distance, m", 1]],
  ["bearing_deg", ["bearing, °", 1]],
]);
const APART: readonly string[] = ["score", "probability"];

export function costInWords(terms: Readonly<Record<string, unknown>>): CostInWords {
  const found = Object.entries(terms)
    .map(([code, value]) => ({ code, value: Number(value) }))
    .filter(({ value }) => Number.isFinite(value));
  const score = found.find(({ code }) => code === "score");
  const probability = found.find(({ code }) => code === "probability");
  const order = [...SUMMANDS.keys()];
  const place = (code: string): number => (order.includes(code) ? order.indexOf(code) : order.length);
  return {
    summands: found
      .filter(({ code }) => !APART.includes(code))
      .sort((a, b) => place(a.code) - place(b.code))
      .map(({ code, value }) => {
        const [name, factor] = SUMMANDS.get(code) ?? [code.replaceAll("_", " "), 1];
        return { name, value: factor * value };
      }),
    dividedBy: score === undefined ? null : { name: "score", value: score.value },
    probability: probability?.value ?? null,
  };
}
