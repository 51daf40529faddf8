/**
 * Keypoints as a table: `name,u_px,v_px,lat_deg,lon_deg,height_m,role`, a line a keypoint, as the
 * REST interface and spreadsheets speak it. Separated by comma, semicolon or tab; decimal commas
 * are understood where the comma does not separate. Lines without u and v are landmarks alone.
 */
import { parseAngle, parseNumber, type Parsed } from "../model/coordinates";
import { ROLES, type Point, type Role } from "../model/point";
import type { ImportLine, ImportedPoint } from "./import-plan";

const COLUMNS = ["name", "u_px", "v_px", "lat_deg", "lon_deg", "height_m", "role"] as const;
type Column = (typeof COLUMNS)[number];

export function writeCsv(points: readonly Point[]): string {
  const lines = points.map((point) =>
    [
      quoted(point.name),
      point.pixel?.[0] ?? "",
      point.pixel?.[1] ?? "",
      point.place?.latDeg ?? "",
      point.place?.lonDeg ?? "",
      point.place?.heightM ?? "",
      point.role,
    ].join(","),
  );
  return `${[COLUMNS.join(","), ...lines].join("\n")}\n`;
}

function quoted(name: string): string {
  return /[",;\t\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name;
}

export function readCsv(text: string): ImportLine[] {
  const lines = text
    .replace(/^\uFEFF/, "")
    .split(/\r\n|\r|\n/)
    .map((line, index) => ({ line, number: index + 1 }))
    .filter(({ line }) => line.trim() !== "" && !line.startsWith("#"));
  const first = lines[0];
  if (first === undefined) {
    return [{ line: 1, error: "The file is empty; it needs a line a keypoint." }];
  }
  const separator = separatorOf(first.line);
  const head = cellsOf(first.line, separator).map((cell) => cell.trim().toLowerCase());
  const hasHead = head.includes("name") || head.includes("lat_deg") || head.includes("u_px");
  const unknown = hasHead ? head.filter((cell) => !isColumn(cell)) : [];
  if (unknown.length > 0 || (hasHead && !head.includes("name"))) {
    const why = unknown.length > 0 ? `The header has unknown columns: “${unknown.join("”, “")}”` : "The header misses “name”";
    return [{ line: first.number, error: `${why}. Columns are ${COLUMNS.join(", ")}.` }];
  }
  const columns: readonly string[] = hasHead ? head : COLUMNS;
  return lines
    .slice(hasHead ? 1 : 0)
    .map(({ line, number }) => readLine(cellsOf(line, separator), columns, number, separator));
}

function separatorOf(line: string): string {
  const count = (separator: string): number => line.split(separator).length;
  return [",", ";", "\t"].reduce((best, next) => (count(next) > count(best) ? next : best));
}

function isColumn(cell: string): cell is Column {
  return (COLUMNS as readonly string[]).includes(cell);
}

/** Cells of one line; quotes protect separators, doubled quotes are quotes. */
function cellsOf(line: string, separator: string): string[] {
  const cells: string[] = [];
  let cell = "";
  let isQuoted = false;
  for (let index = 0; index < line.length; index += 1) {
    const character = line[index] ?? "";
    if (character === '"' && isQuoted && line[index + 1] === '"') {
      cell += '"';
      index += 1;
    } else if (character === '"' && (isQuoted || cell.trim() === "")) {
      isQuoted = !isQuoted;
    } else if (character === separator && !isQuoted) {
      cells.push(cell);
      cell = "";
    } else {
      cell += character;
    }
  }
  return [...cells, cell];
}

function readLine(
  cells: readonly string[],
  columns: readonly string[],
  line: number,
  separator: string,
): ImportLine {
  const extra = cells.slice(columns.length);
  if (extra.some((cell) => cell.trim() !== "")) {
    const hint =
      separator === "," && cells.length > columns.length + 1
        ? " Numbers with decimal commas need semicolons between the columns."
        : "";
    return { line, error: `${cells.length} columns where ${columns.length} are known.${hint}` };
  }
  const value = (column: Column): string => cells[columns.indexOf(column)]?.trim() ?? "";
  const name = value("name");
  if (name === "") {
    return { line, error: "The name is missing." };
  }
  return pointOf(name, value, line);
}

function pointOf(name: string, value: (column: Column) => string, line: number): ImportLine {
  const problems: string[] = [];
  const number = (parsed: Parsed<number>, column: Column): number => {
    if (parsed.error !== undefined) {
      problems.push(`${column}: ${parsed.error}`);
      return 0;
    }
    return parsed.value;
  };
  const group = (columns: readonly Column[]): boolean => {
    const given = columns.filter((column) => value(column) !== "");
    if (given.length > 0 && given.length < columns.length) {
      const missing = columns.filter((column) => value(column) === "");
      problems.push(`${missing.join(" and ")} missing: give ${columns.join(", ")} together.`);
    }
    return given.length === columns.length;
  };
  const role = value("role").toLowerCase() || "control";
  if (!isRole(role)) {
    problems.push(`role: “${role}” is none of ${ROLES.join(", ")}.`);
  }
  const hasPlace = group(["lat_deg", "lon_deg", "height_m"]);
  const hasPixel = group(["u_px", "v_px"]);
  const point: ImportedPoint = {
    name,
    role: isRole(role) ? role : "control",
    place: hasPlace
      ? {
          latDeg: number(parseAngle(value("lat_deg"), "lat"), "lat_deg"),
          lonDeg: number(parseAngle(value("lon_deg"), "lon"), "lon_deg"),
          heightM: number(parseNumber(value("height_m"), "metres above the ellipsoid"), "height_m"),
        }
      : null,
    pixel: hasPixel
      ? [
          number(parseNumber(value("u_px"), "a pixel"), "u_px"),
          number(parseNumber(value("v_px"), "a pixel"), "v_px"),
        ]
      : null,
  };
  if (problems.length === 0 && point.place === null && point.pixel === null) {
    problems.push("Neither a place nor a pixel is given.");
  }
  return problems.length > 0 ? { line, error: problems.join(" ") } : { line, point };
}

function isRole(text: string): text is Role {
  return (ROLES as readonly string[]).includes(text);
}
