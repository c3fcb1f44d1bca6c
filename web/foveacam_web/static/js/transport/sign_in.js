// Whether this browser is still signed in, judged by the answers to the requests of one page or worker.

/** Dispatches changes of the sign-in. While a page has set `over`, its requests fail at once, except the stop. */
export class SignIn extends EventTarget {
  over = false;

  /** Dispatch "refused": the server seems to accept this browser's sign-in no longer. */
  refuse() {
    this.dispatchEvent(new Event("refused"));
  }

  /** Tell that the server knows this browser again. */
  restore() {
    if (!this.over) return;
    this.over = false;
    this.dispatchEvent(new Event("restored"));
  }
}

export const signIn = new SignIn();
