/**
 * Sets the chosen theme before the first paint. Loaded as a classic script in the head, so it
 * imports nothing and leaves no name behind; the toggle itself lives in page/theme-toggle.ts.
 */
{
  let stored: string | null = null;
  try {
    stored = localStorage.getItem("quaymark.theme");
  } catch {
    // Storage may be forbidden; the system's preference holds then.
  }
  if (stored === "light" || stored === "dark") {
    document.documentElement.dataset["theme"] = stored;
  }
}
