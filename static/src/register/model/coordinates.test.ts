import { describe, expect, it } from "vitest";
import { parseAngle, parseNumber, splitPair, writeDms } from "./coordinates";

describe("parseAngle", () => {
  it.each([
    ["53.541", 53.541],
    ["53,541 N", 53.541],
    ["-53.541", -53.541],
    ["S 53.541", -53.541],
    ["53 32 27.6 N", 53.541],
    ["53°32'27.6\"N", 53.541],
    ["53° 32′ 27.600″ N", 53.541],
    ["53d 32.46m", 53.541],
    ["0 30 S", -0.5],
    ["-0 30", -0.5],
  ])("reads %s", (text, degrees) => {
    expect(parseAngle(text, "lat").error).toBeUndefined();
    expect((parseAngle(text, "lat") as { value: number }).value).toBeCloseTo(degrees, 10);
  });

  it.each([
    ["", "Give the latitude"],
    ["53 75 10 N", "75 minutes are too many"],
    ["53 10 61 N", "61 seconds are too many"],
    ["53.5 20 N", "Only the last part"],
    ["9 58 48 E", "latitude and longitude exchanged"],
    ["91.2", "between −90 and 90, not 91.2."],
    ["-53 N", "both a minus sign and N"],
    ["53 -12 N", "Only the degrees"],
    ["north", "is no coordinate"],
    ["1 2 3 4", "is no coordinate"],
  ])("refuses %s", (text, reason) => {
    expect(parseAngle(text, "lat").error).toContain(reason);
  });

  it("writes degrees, minutes and seconds that read back", () => {
    expect(writeDms(53.541, "lat")).toBe("53° 32′ 27.600″ N");
    expect(writeDms(-9.9999999999, "lon")).toBe("10° 00′ 00.000″ W");
    expect(parseAngle(writeDms(-9.98012, "lon"), "lon")).toMatchObject({ value: expect.closeTo(-9.98012, 6) as number });
  });
});

describe("splitPair", () => {
  it.each([
    ["53.541, 9.9801", "53.541", "9.9801"],
    ["53 32 27.6 N, 9 58 48 E", "53 32 27.6 N", "9 58 48 E"],
    ["N 53 32.46 E 9 58.8", "N 53 32.46", "E 9 58.8"],
    ["53,541; 9,9801", "53,541", "9,9801"],
  ])("takes %s apart", (text, lat, lon) => {
    expect(splitPair(text)?.map((part) => part.trim().replace(/,$/, ""))).toEqual([lat, lon]);
  });

  it("leaves a single coordinate alone", () => {
    expect(splitPair("53 32 27.6 N")).toBeNull();
    expect(splitPair("53.541")).toBeNull();
  });
});

it("parseNumber reads a decimal comma and refuses words", () => {
  expect(parseNumber("4,25", "a height")).toEqual({ value: 4.25 });
  expect(parseNumber("4.2 m", "a height").error).toContain("is no number");
});
