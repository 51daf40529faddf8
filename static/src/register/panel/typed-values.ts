/** What may be typed into the fields of a keypoint, with the error to show beside the field. */
import type { Editor } from "../editor";
import { parseNumber, type Parsed } from "../model/coordinates";
import type { Point } from "../model/point";

const LONGEST_NAME = 200;

export function checkName(text: string, point: Point, editor: Editor): Parsed<string> {
  const name = text.trim();
  if (name === "") {
    return { error: "Give a name." };
  }
  if (name.length > LONGEST_NAME) {
    return { error: `At most ${LONGEST_NAME} characters.` };
  }
  if (editor.points.some((other) => other.key !== point.key && other.name === name)) {
    return { error: `Another keypoint here is named “${name}”.` };
  }
  const landmark = editor.landmarks.find((other) => other.name === name);
  if (landmark !== undefined && landmark.id !== point.landmarkId && point.place !== null) {
    return { error: `“${name}” is another landmark of the site; pick it from the landmarks instead.` };
  }
  return { value: name };
}

/** A pixel coordinate inside the image: u by its width, v by its height. */
export function checkPixel(text: string, axis: "u" | "v", editor: Editor): Parsed<number> {
  const parsed = parseNumber(text, `${axis} in pixels, for example 812.5`);
  if (parsed.error !== undefined) {
    return parsed;
  }
  const { widthPx, heightPx } = editor.world.intrinsics;
  const most = (axis === "u" ? widthPx : heightPx) - 0.5;
  return parsed.value >= -0.5 && parsed.value <= most
    ? parsed
    : { error: `${axis} runs from -0.5 to ${most} in this image.` };
}
