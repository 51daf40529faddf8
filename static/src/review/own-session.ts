/**
 * Whether the browser is still signed in as the person whose page this is. Another tab may have
 * signed somebody else in: what waits here must not go out under that name.
 */
import { ApiProblem, call } from "../api";

/** Somebody else is signed in; what waits goes on waiting. */
export class SomebodyElse extends Error {
  override readonly name = "SomebodyElse";
}

export class OwnSession {
  private isSure = true;

  constructor(private readonly email: string) {
    document.addEventListener("visibilitychange", () => {
      this.isSure &&= document.hidden; // back from another tab, which may have signed out and in
    });
  }

  /** Does something in the person's name, and only in theirs. Throws what it throws. */
  async run<Answer>(act: () => Promise<Answer>): Promise<Answer> {
    if (!this.isSure) {
      const me = (await call("/api/v1/me")) as { readonly email: string };
      if (me.email !== this.email) {
        throw new SomebodyElse("Somebody else is signed in in this browser.");
      }
      this.isSure = true;
    }
    try {
      return await act();
    } catch (error) {
      this.isSure &&= !(error instanceof ApiProblem && error.status === 401);
      throw error;
    }
  }
}
