/** The tabs beside the table: arrows move between them, as everywhere. */
export type Tab = "keypoint" | "landmarks" | "methods" | "readiness";

export class SideTabs {
  private readonly tabs: readonly HTMLButtonElement[];

  constructor(private readonly root: HTMLElement) {
    this.tabs = [...root.querySelectorAll<HTMLButtonElement>("[data-tab]")];
    for (const [index, tab] of this.tabs.entries()) {
      tab.addEventListener("click", () => {
        this.show(tab.dataset["tab"] as Tab);
      });
      tab.addEventListener("keydown", (event) => {
        const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        const next = this.tabs[(index + (by ?? 0) + this.tabs.length) % this.tabs.length];
        if (by !== undefined && next !== undefined) {
          event.preventDefault();
          this.show(next.dataset["tab"] as Tab);
          next.focus();
        }
      });
    }
  }

  show(name: Tab): void {
    for (const tab of this.tabs) {
      const isShown = tab.dataset["tab"] === name;
      tab.setAttribute("aria-selected", String(isShown));
      tab.tabIndex = isShown ? 0 : -1;
      const panel = this.root.querySelector<HTMLElement>(`#panel-${tab.dataset["tab"] ?? ""}`);
      if (panel !== null) {
        panel.hidden = !isShown;
      }
    }
  }
}
