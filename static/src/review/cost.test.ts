import { describe, expect, it } from "vitest";
import { costInWords } from "./cost";

describe("the matching cost in words", () => {
  const terms = { bottom: 0.007, center_x: 0.003, score: 0.9, width: 0.005 };

  it("lists what is added up as it counts, and the score as what it is divided by", () => {
    const { summands, dividedBy } = costInWords(terms);
    expect(summands).toEqual([
      { name: "centre, twice", value: 0.006 },
      { name: "lower edge", value: 0.007 },
      { name: "width", value: 0.005 },
    ]);
    expect(dividedBy).toEqual({ name: "score", value: 0.9 });
  });

  it("gives the cost again", () => {
    const { summands, dividedBy } = costInWords(terms);
    const sum = summands.reduce((total, { value }) => total + value, 0);
    expect(sum / (dividedBy?.value ?? 1)).toBeCloseTo((2 * 0.003 + 0.007 + 0.005) / 0.9, 12);
  });

  it("leaves out a width that was not compared and keeps terms it does not know", () => {
    const { summands, dividedBy } = costInWords({ center_x: 0.1, time_gap: 0.2, bottom: 0.3 });
    expect(summands.map(({ name }) => name)).toEqual(["centre, twice", "lower edge", "time gap"]);
    expect(dividedBy).toBeNull();
  });

  it("tells sigmas and the probability of a match by likelihood", () => {
    const { summands, probability } = costInWords({ probability: 0.98, width_sigmas: 1, middle_sigmas: 2 });
    expect(summands.map(({ name }) => name)).toEqual(["middle, σ", "width, σ"]);
    expect(probability).toBe(0.98);
  });
});
