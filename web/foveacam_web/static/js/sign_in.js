// Whether this browser is still signed in, as the answers to the requests of one page or worker tell.

/** Passes on that an answer was 401. While a page has set `over`, its requests fail at once, the stop excepted. */
export class SignIn extends EventTarget {
  over = false;

  /** Tell that the server does not know this browser any more. */
  refuse() {
    this.dispatchEvent(new Event("refused"));
  }
}

export const signIn = new SignIn();
