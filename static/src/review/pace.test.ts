import { describe, expect, it } from "vitest";
import { Pace } from "./pace";

function paceOf(...seconds: number[]): Pace {
  const pace = new Pace();
  for (const value of seconds) {
    pace.add(value);
  }
  return pace;
}

describe("a reviewer's pace", () => {
  it("says nothing from too few decisions", () => {
    expect(paceOf(1, 2).remainingS(10)).toBeNull();
  });

  it("is the median, untouched by one long pause", () => {
    expect(paceOf(1, 2, 600).secondsPerPose()).toBe(2);
    expect(paceOf(1, 2, 4, 600).secondsPerPose()).toBe(3);
    expect(paceOf(1, 2, 600).remainingS(30)).toBe(60);
  });

  it("forgets what was long ago", () => {
    const many = Array.from({ length: 30 }, () => 1);
    expect(paceOf(...Array.from({ length: 30 }, () => 9), ...many).secondsPerPose()).toBe(1);
  });
});
