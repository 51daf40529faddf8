import { expect, it } from "vitest";
import { syncText } from "./sync-status";

it("says where the grades are, in numbers that agree with their words", () => {
  expect(syncText("idle", 0)).toBe("All grades saved");
  expect(syncText("offline", 1)).toBe("No connection, 1 grade kept here");
  expect(syncText("signed-out", 3)).toBe("Signed out, 3 grades kept here");
  expect(syncText("sending", 12)).toBe("Saving 12 grades");
});
