// Whether this browser is still signed in, as the answers to the requests of one page or worker tell.

/** Passes on what answers tell. While a page has set `over`, its requests fail at once, the stop excepted. */
export class SignIn extends EventTarget {
  over = false;

  /** Tell that the server seems not to know this browser any more. */
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
