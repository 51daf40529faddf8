import { expect, it } from "vitest";
import { shipType } from "./ship-type";

it.each([
  [52, "Tug"],
  [70, "Cargo ship"],
  [79, "Cargo ship"],
  [0, null],
  [38, null],
  [null, null],
  [85, "Tanker"],
])("reads ship type %s as %s", (value, words) => {
  expect(shipType(value)).toBe(words);
});
