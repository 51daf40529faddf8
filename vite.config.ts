/**
 * The build of the islands: one hashed script per island and one stylesheet, with a manifest
 * from which the pages look up the names. Paths are relative so that the folder may be mounted
 * anywhere, and nothing is inlined because the pages are served under a strict CSP.
 */
import { defineConfig } from "vitest/config";

const ISLANDS = ["theme", "main", "review", "run", "live", "practice", "upload", "import", "register", "reregistration", "calibration", "ais-map", "boxes"];

export default defineConfig({
  base: "./",
  publicDir: false,
  build: {
    outDir: "static/dist",
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
