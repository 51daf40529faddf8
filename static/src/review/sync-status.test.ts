import { expect, it } from "vitest";
import { syncText } from "./sync-status";

it("says where the work is, in numbers that agree with their words", () => {
  expect(syncText("idle", 0)).toBe("All saved");
  expect(syncText("offline", 1)).toBe("No connection, 1 change kept here");
  expect(syncText("signed-out", 3)).toBe("Signed out, 3 changes kept here");
  expect(syncText("somebody-else", 1)).toBe("Signed in as somebody else, 1 change kept here");
  expect(syncText("sending", 12)).toBe("Saving 12 changes");
});
