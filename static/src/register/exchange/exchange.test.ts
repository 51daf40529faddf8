import { describe, expect, it } from "vitest";
import { NO_DISTORTION } from "../../geometry/distortion";
import { EnuFrame } from "../../geometry/geodesy";
import type { Point } from "../model/point";
import { readCsv, writeCsv } from "./csv";
import { readGeoJson, writeGeoJson } from "./geojson";
import { planImport, type ImportWorld } from "./import-plan";

const CRANE: Point = {
  key: "landmark-7",
  landmarkId: 7,
  name: 'Crane, "old"',
  place: { latDeg: 53.541, lonDeg: 9.9801, heightM: 92.4 },
  pixel: [812.5, 640],
  role: "check",
};
const WORLD: ImportWorld = {
  points: [CRANE],
  landmarks: [{ id: 7, name: CRANE.name, place: { latDeg: 53.541, lonDeg: 9.9801, heightM: 92.4 }, viewportCount: 1, version: 1 }],
  frame: new EnuFrame({ latDeg: 53.54, lonDeg: 9.98, heightM: 40 }),
  intrinsics: { widthPx: 1280, heightPx: 960, fxPx: 1500, fyPx: 1500, cxPx: 640, cyPx: 480, distortion: NO_DISTORTION },
};

describe("CSV", () => {
  it("reads back what it writes, quotes and all", () => {
    const [line] = readCsv(writeCsv([CRANE]));
    expect(line?.point).toEqual({ name: CRANE.name, role: "check", place: CRANE.place, pixel: CRANE.pixel });
  });

  it("understands semicolons with decimal commas, and columns in another order", () => {
    const [line] = readCsv("v_px;u_px;name;lat_deg;lon_deg;height_m\n640,5;812,25;Mole;53,54;9,98;43,1\n");
    expect(line?.point).toMatchObject({ name: "Mole", pixel: [812.25, 640.5], place: { heightM: 43.1 } });
  });

  it("says by line what is wrong, also of commas for points", () => {
    const lines = readCsv(
      "name,u_px,v_px,lat_deg,lon_deg,height_m,role\n" +
        "Comma,812,5,640,0,53,541,9,98,43\n" +
        "Half,1,2,53.5,,3,control\n" +
        "Role,1,2,53.5,9.9,3,boss\n" +
        "Minutes,1,2,53 75 N,9.9,3,\n" +
        ",1,2,53.5,9.9,3,control\n",
    );
    expect(lines.map(({ line }) => line)).toEqual([2, 3, 4, 5, 6]);
    expect(lines.map(({ error }) => error)).toEqual([
      expect.stringContaining("need semicolons"),
      expect.stringContaining("lon_deg missing"),
      expect.stringContaining("“boss” is none of"),
      expect.stringContaining("75 minutes"),
      expect.stringContaining("name is missing"),
    ]);
    expect(readCsv("")[0]?.error).toContain("empty");
    expect(readCsv("name,x,y\nA,1,2")[0]?.error).toContain("unknown columns: “x”");
  });
});

describe("GeoJSON", () => {
  it("reads back what it writes", () => {
    const [line] = readGeoJson(writeGeoJson([CRANE]));
    expect(line?.point).toEqual({ name: CRANE.name, role: "check", place: CRANE.place, pixel: CRANE.pixel });
  });

  it("says by feature what is wrong", () => {
    const text = JSON.stringify({
      type: "FeatureCollection",
      features: [
        { type: "Feature", properties: { name: "A" }, geometry: { type: "Point", coordinates: [9.98, 53.54] } },
        { type: "Feature", properties: {}, geometry: null },
      ],
    });
    expect(readGeoJson(text).map(({ error }) => error)).toEqual([
      expect.stringContaining("height"),
      expect.stringContaining("name"),
    ]);
    expect(readGeoJson("{")[0]?.error).toContain("no JSON");
    expect(readGeoJson("{}")[0]?.error).toContain("FeatureCollection");
  });
});

describe("planImport", () => {
  it("tells new, changed, unchanged and wrong lines apart before anything is done", () => {
    const plan = planImport(
      readCsv(
        "name,u_px,v_px,lat_deg,lon_deg,height_m,role\n" +
          '"Crane, ""old""",812.5,640,53.541,9.9801,92.4,check\n' +
          "Mole,100,100,53.5405,9.981,41,control\n" +
          "Mole,101,100,53.5405,9.981,41,control\n" +
          "Out,5000,100,53.5405,9.981,41,control\n" +
          "Swapped,100,100,9.981,53.5405,41,control\n" +
          "Unknown,100,100,,,,control\n",
      ),
      WORLD,
    );
    expect(plan.lines.map(({ effect }) => effect)).toEqual(["unchanged", "new", "error", "error", "error", "error"]);
    expect(plan.lines[2]?.note).toContain("line 3 already");
    expect(plan.lines[3]?.note).toContain("outside of the image");
    expect(plan.lines[4]?.note).toContain("exchanged");
    expect(plan.lines[5]?.note).toContain("No landmark");
    expect(plan.points).toHaveLength(2);
  });

  it("says how far a known landmark would move", () => {
    const plan = planImport(readCsv('"Crane, ""old""",812.5,640,53.5411,9.9801,92.4,check'), WORLD);
    expect(plan.lines[0]).toMatchObject({ effect: "changes", note: "moves the landmark by 11 m" });
    expect(plan.points[0]).toMatchObject({ key: "landmark-7", landmarkId: 7 });
  });
});
