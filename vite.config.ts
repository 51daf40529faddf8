/**
 * The build of the islands: one hashed script per island and one stylesheet, with a manifest
 * from which the pages look up the names. Paths are relative so that the folder may be mounted
 * anywhere, and nothing is inlined because the pages are served under a strict CSP.
 */
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync, gzipSync } from "node:zlib";

import { defineConfig } from "vitest/config";

const ISLANDS = ["theme", "main", "review", "run", "live", "practice", "upload", "import", "register", "reregistration", "calibration", "ais-map", "boxes"];

const DIST = "static/dist";

/** Lay each text beside itself, packed as small as it goes: packing it anew for each browser would not pay. */
const packed = {
  name: "packed",
  apply: "build" as const,
  closeBundle(): void {
    for (const name of readdirSync(DIST, { recursive: true, encoding: "utf-8" })) {
      if (/\.(js|css|svg)$/.test(name)) {
        const path = join(DIST, name);
        const text = readFileSync(path);
        writeFileSync(`${path}.br`, brotliCompressSync(text));
        writeFileSync(`${path}.gz`, gzipSync(text, { level: 9 }));
      }
    }
  },
};

export default defineConfig({
  base: "./",
  plugins: [packed],
  publicDir: false,
  build: {
    outDir: DIST,
    emptyOutDir: true,
    manifest: true,
    target: "es2022",
    // light-dark() and nesting are in every browser since 2024; lowering them would break themes.
    cssTarget: ["chrome123", "firefox120", "safari17.5"],
    assetsInlineLimit: 0,
    sourcemap: true,
    // The polyfill would make the classic theme script a module.
    modulePreload: { polyfill: false },
    rollupOptions: {
      input: Object.fromEntries(ISLANDS.map((name) => [name, `static/src/${name}.ts`])),
    },
  },
  test: {
    environment: "node",
    include: ["static/src/**/*.test.ts"],
  },
});
