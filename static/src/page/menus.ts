/** Menus are <details data-menu>: they close on Escape and on a click elsewhere. */

export function enableMenus(root: Document): void {
  const openMenus = (): HTMLDetailsElement[] => [
    ...root.querySelectorAll<HTMLDetailsElement>("details[data-menu][open]"),
  ];
  root.addEventListener("click", (event) => {
    for (const menu of openMenus()) {
      if (!(event.target instanceof Node && menu.contains(event.target))) {
        menu.open = false;
      }
    }
  });
  root.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      for (const menu of openMenus()) {
        menu.open = false;
        menu.querySelector("summary")?.focus();
      }
    }
  });
}
