/** The colours of the drawing, from the page's own style: canvases know no custom properties. */

export interface Palette {
  readonly track: string;
  readonly vessel: string;
  readonly casing: string;
  readonly flagged: string;
  readonly chosen: string;
  readonly text: string;
}

export function paletteOf(element: HTMLElement): Palette {
  // A light-dark() value is only resolved where a property uses it.
  const probe = document.createElement("span");
  probe.hidden = true;
  element.append(probe);
  const colour = (name: string): string => {
    probe.className = `traffic-colour traffic-colour--${name}`;
    return getComputedStyle(probe).color;
  };
  const palette = {
    track: colour("track"),
    vessel: colour("vessel"),
    casing: colour("casing"),
    flagged: colour("flagged"),
    chosen: colour("chosen"),
    text: colour("text"),
  };
  probe.remove();
  return palette;
}

/** Calls back when the theme changes, by the page's switch or by the system. */
export function onThemeChange(change: () => void): void {
  new MutationObserver(change).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", change);
}
