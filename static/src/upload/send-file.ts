/** One photograph to the server, with the share sent so far: fetch cannot tell it, XHR can. */
import { Unreachable, problemFrom } from "../api";
import { randomKey } from "../random-key";

/** Resolves to whether the image was new (201) or known already (200). */
export function sendFile(
  url: string,
  form: FormData,
  onShare: (share: number) => void,
): Promise<"stored" | "known"> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", url);
    request.setRequestHeader("Accept", "application/json");
    request.setRequestHeader("Idempotency-Key", randomKey());
    request.upload.addEventListener("progress", (event) => {
      if (event.lengthComputable && event.total > 0) {
        onShare(event.loaded / event.total);
      }
    });
    request.addEventListener("load", () => {
      if (request.status === 200 || request.status === 201) {
        resolve(request.status === 201 ? "stored" : "known");
      } else {
        reject(problemFrom(request.status, parse(request.responseText), request.statusText));
      }
    });
    request.addEventListener("error", () => {
      reject(new Unreachable("The server cannot be reached. Check the connection."));
    });
    request.send(form);
  });
}

function parse(text: string): unknown {
  try {
    return JSON.parse(text) as unknown;
  } catch {
    return null;
  }
}
