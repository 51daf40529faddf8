import { describe, expect, it } from "vitest";
import { addressOf, delayMs } from "./live";

describe("delayMs", () => {
  it("waits as long as the page wants when answers are quick", () => {
    expect(delayMs(5, 30)).toBe(5000);
  });

  it("waits longer when an answer costs the server much", () => {
    expect(delayMs(5, 900)).toBe(18_000);
  });
});

describe("addressOf", () => {
  it("leaves out what was left empty, so that the address shows what was chosen", () => {
    const fields: [string, string][] = [
      ["run_id", "3"],
      ["from", ""],
      ["by", "range"],
    ];
    expect(addressOf("/evaluation/reviews", fields)).toBe("/evaluation/reviews?run_id=3&by=range");
  });

  it("is the bare page when nothing was chosen", () => {
    expect(addressOf("/evaluation", [["run_id", ""]])).toBe("/evaluation");
  });
});
