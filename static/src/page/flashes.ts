/** Messages above the content: dismissed by their cross, and shown by islands with showFlash. */

export type Tone = "info" | "success" | "warning" | "error";

export function enableFlashes(root: Document): void {
  root.addEventListener("click", (event) => {
    if (event.target instanceof Element && event.target.closest("[data-dismiss]") !== null) {
      event.target.closest(".flash")?.remove();
    }
  });
}

const LINGER_MS = 10_000;

/**
 * Shows a message in the page's flash area, once however often it is said; errors are announced.
 * Good news leaves by itself, so that nothing lies over the work; what needs an answer stays.
 */
export function showFlash(message: string, tone: Tone): void {
  const area = document.querySelector("[data-flashes]");
  if (area === null) {
    return;
  }
  const isThere = [...area.querySelectorAll(".flash > div")].some(
    (shown) => shown.textContent === message,
  );
  if (isThere) {
    return;
  }
  const flash = document.createElement("div");
  flash.className = `flash flash--${tone}`;
  flash.setAttribute("role", tone === "error" ? "alert" : "status");
  const text = document.createElement("div");
  text.textContent = message;
  const close = document.createElement("button");
  close.type = "button";
  close.className = "button button--quiet button--small";
  close.dataset["dismiss"] = "";
  close.textContent = "Dismiss";
  flash.append(text, close);
  area.append(flash);
  if (tone === "success" || tone === "info") {
    leaveLater(flash);
  }
}

/** Removes a message after a while, but not from under a pointer or the focus. */
function leaveLater(flash: HTMLElement): void {
  setTimeout(() => {
    if (flash.matches(":hover, :focus-within")) {
      leaveLater(flash);
    } else {
      flash.remove();
    }
  }, LINGER_MS);
}
