/** The practice page's island: a key for each grade, Enter for the next, Space to lift the box. */

const photo = document.querySelector<SVGElement>(".practice");

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) {
    return;
  }
  if (event.code === "Space" && !(event.target instanceof HTMLButtonElement)) {
    event.preventDefault();
    photo?.classList.add("is-bare");
    return;
  }
  const target = document.querySelector<HTMLElement>(`[data-key="${CSS.escape(event.code)}"]`);
  if (target !== null && document.activeElement !== target) {
    event.preventDefault();
    target.click();
  }
});

document.addEventListener("keyup", (event) => {
  if (event.code === "Space") {
    photo?.classList.remove("is-bare");
  }
});
