import { describe, expect, it } from "vitest";
import { duration, heading, localTime, number, position, quantity, utc } from "./format";

describe("numbers", () => {
  it("sets thousands apart and keeps the decimals asked for", () => {
    expect(number(1234567.891, 2)).toBe("1\u202f234\u202f567.89");
    expect(number(999)).toBe("999");
  });

  it("writes a true minus, and none for what rounds to nothing", () => {
    expect(number(-2.5, 1)).toBe("−2.5");
    expect(number(-0.01, 1)).toBe("0.0");
  });

  it("shows a dash for what is unknown", () => {
    expect([number(null), number(Number.NaN), quantity(undefined, "m")]).toEqual(["–", "–", "–"]);
    expect(quantity(19, "m", 1)).toBe("19.0\u00a0m");
  });
});

describe("durations", () => {
  it.each([
    [0, "0 s"],
    [59.4, "59 s"],
    [59.6, "1 min 00 s"],
    [3599, "59 min 59 s"],
    [7830, "2 h 10 min"],
    [-3, "0 s"],
  ])("writes %d seconds as %s", (seconds, text) => {
    expect(duration(seconds)).toBe(text);
  });
});

describe("places and moments", () => {
  it("names hemispheres instead of signs", () => {
    expect(position(-53.539719, 9.98)).toBe("53.53972°\u00a0S, 9.98000°\u00a0E");
  });

  it("wraps headings into one turn, also by rounding", () => {
    expect([heading(112), heading(-1), heading(359.96), heading(7.25)]).toEqual([
      "112.0°",
      "359.0°",
      "000.0°",
      "007.3°",
    ]);
  });

  it("writes moments in UTC whatever zone they came in", () => {
    expect(utc("2026-11-22T12:00:05+02:00")).toBe("2026-11-22 10:00:05\u00a0UTC");
    expect(utc("yesterday")).toBe("–");
  });
});

describe("times of a zone", () => {
  it("names the zone, and the date where it is another one", () => {
    expect(localTime("2026-11-22T10:00:05Z", "Europe/Berlin")).toBe("11:00:05\u00a0CET");
    expect(localTime("2026-07-01T22:30:00Z", "Europe/Berlin")).toBe("2026-07-02 00:30:00\u00a0CEST");
    expect(localTime("never", "UTC")).toBe("–");
  });
});
