/** Dialogs: data-opens="ID" opens the <dialog> of that id, data-closes inside it closes it. */

export function enableDialogs(root: Document): void {
  root.addEventListener("click", (event) => {
    if (!(event.target instanceof Element)) {
      return;
    }
    const opener = event.target.closest<HTMLElement>("[data-opens]");
    const id = opener?.dataset["opens"];
    if (id !== undefined) {
      openDialog(root, id);
    }
    if (event.target.closest("[data-closes]") !== null) {
      event.target.closest("dialog")?.close();
    }
  });
}

export function openDialog(root: Document, id: string): void {
  const dialog = root.getElementById(id);
  if (dialog instanceof HTMLDialogElement) {
    dialog.showModal();
  }
}
