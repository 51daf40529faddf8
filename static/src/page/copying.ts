/** Buttons that copy a text: data-copy names the element that has it. */
export function enableCopying(root: Document): void {
  if (!("clipboard" in navigator)) {
    root.documentElement.classList.add("no-clipboard"); // came from elsewhere without TLS
    return;
  }
  root.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("[data-copy]") : null;
    const source = root.getElementById(button?.getAttribute("data-copy") ?? "");
    if (button !== null && source !== null) {
      void copy(source.textContent, button);
    }
  });
}

async function copy(text: string, button: Element): Promise<void> {
  await navigator.clipboard.writeText(text);
  button.textContent = "Copied";
}
