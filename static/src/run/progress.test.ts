import { describe, expect, it } from "vitest";
import { counted, hasEnded, pace, type RunProgress } from "./progress";

const RUNNING: RunProgress = {
  status: "running",
  images_done: 61,
  images_total: 2400,
  images_per_s: 12.44,
  remaining_s: 188,
  poses: 70,
  detections: 130,
};

describe("a run's progress in words", () => {
  it("counts images, detections and poses", () => {
    expect(counted(RUNNING)).toBe("61 of 2\u202f400 images, 130 detections, 70 poses");
  });

  it("gives rate and remaining time once they are known", () => {
    expect(pace(RUNNING)).toBe("12.4 images/s, 3 min 08 s left");
    expect(pace({ ...RUNNING, remaining_s: null })).toBe("12.4 images/s");
    expect(pace({ ...RUNNING, images_per_s: null })).toBe("");
  });

  it("says what a queued run waits for, and nothing of pace once it has ended", () => {
    expect(pace({ ...RUNNING, status: "queued" })).toBe("Waiting for a worker");
    expect(pace({ ...RUNNING, status: "cancelled" })).toBe("");
  });

  it("knows the states that end a run", () => {
    expect(["queued", "running", "succeeded", "failed", "cancelled"].filter(hasEnded)).toEqual([
      "succeeded",
      "failed",
      "cancelled",
    ]);
  });
});
