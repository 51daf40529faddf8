/** Shows what a time rule gives while it is being chosen: the server renders it, we put it in. */

const SETTLE_MS = 350;

export function watchTimes(form: HTMLFormElement): void {
  let settling: number | undefined;
  let asked = 0;
  const refresh = async (): Promise<void> => {
    const turn = ++asked;
    const fields = [...new FormData(form)].map(([name, value]): [string, string] => [
      name,
      typeof value === "string" ? value : "",
    ]);
    const url = `${form.action}?${new URLSearchParams(fields).toString()}`;
    const response = await fetch(url, { headers: { Accept: "text/html" } }).catch(() => null);
    if (response === null || turn !== asked) {
      return; // the page keeps what it last knew
    }
    if (response.status === 422) {
      location.assign(url); // the page says at the field what is wrong
      return;
    }
    const fresh = new DOMParser().parseFromString(await response.text(), "text/html");
    const next = fresh.getElementById("check");
    const shown = document.getElementById("check");
    if (response.ok && next !== null && shown !== null) {
      shown.replaceChildren(...next.childNodes);
      history.replaceState(null, "", url);
    }
  };
  form.addEventListener("change", () => {
    window.clearTimeout(settling);
    settling = window.setTimeout(() => void refresh(), SETTLE_MS);
  });
}
