/** What a map that follows says of how fresh it is. */
import { number } from "../format";

const QUIET_S = 10;

/** `quietS`: seconds since anything new came; null if nothing did since it began to follow. */
export function formatted(quietS: number | null): string {
  if (quietS === null) {
    return "Live: waiting for the first report";
  }
  return quietS < QUIET_S ? "Live" : `Live: nothing new for ${ago(quietS)}`;
}

export function ago(seconds: number): string {
  return seconds < 60 ? `${number(Math.round(seconds))} s` : `${number(seconds / 60)} min`;
}
