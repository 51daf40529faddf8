/** The light and dark switch: a choice is kept in this browser, otherwise the system decides. */

const KEY = "quaymark.theme";

function isDark(): boolean {
  const chosen = document.documentElement.dataset["theme"];
  return chosen === undefined
    ? matchMedia("(prefers-color-scheme: dark)").matches
    : chosen === "dark";
}

export function enableThemeToggle(root: ParentNode): void {
  for (const button of root.querySelectorAll<HTMLButtonElement>("[data-theme-toggle]")) {
    button.addEventListener("click", () => {
      const theme = isDark() ? "light" : "dark";
      document.documentElement.dataset["theme"] = theme;
      try {
        localStorage.setItem(KEY, theme);
      } catch {
        // Without storage the choice lasts until the page is left.
      }
    });
  }
}
