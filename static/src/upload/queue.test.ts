import { describe, expect, it } from "vitest";
import { eachAtMost } from "./queue";

describe("working through a queue", () => {
  it("does every item once, never more at once than allowed, and starts them in order", async () => {
    let running = 0;
    let most = 0;
    const started: number[] = [];
    await eachAtMost([1, 2, 3, 4, 5, 6, 7], 3, async (item) => {
      running += 1;
      most = Math.max(most, running);
      started.push(item);
      await Promise.resolve();
      await Promise.resolve();
      running -= 1;
    });
    expect(started).toEqual([1, 2, 3, 4, 5, 6, 7]);
    expect(most).toBe(3);
  });

  it("has nothing to do for no items", async () => {
    await expect(eachAtMost([], 3, () => Promise.reject(new Error("called")))).resolves.toBe(
      undefined,
    );
  });
});
