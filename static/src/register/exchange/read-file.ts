/** A dropped or chosen file becomes lines, by its content and not by its name. */
import { readCsv } from "./csv";
import { readGeoJson } from "./geojson";
import type { ImportLine } from "./import-plan";

const MOST_BYTES = 2_000_000;

export async function readFile(file: File): Promise<ImportLine[]> {
  if (file.size > MOST_BYTES) {
    return [{ line: 1, error: "The file is far too large for keypoints (above 2 MB)." }];
  }
  const text = new TextDecoder("utf-8").decode(await file.arrayBuffer());
  if (text.includes("\uFFFD")) {
    return [{ line: 1, error: "The file is no text in UTF-8; save it as CSV UTF-8." }];
  }
  return text.trimStart().startsWith("{") ? readGeoJson(text) : readCsv(text);
}
