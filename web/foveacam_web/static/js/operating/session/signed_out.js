// Modal dialog of a browser that was signed out; the page continues once it is signed in again.

import { RequestError, whoAmI } from "../../transport/api.js";
import { fill, h, html } from "../../elements/dom.js";
import { signIn } from "../../transport/sign_in.js";

/** @import { Store } from "#console" */

const SETTLE_MS = 300; // an order of this page may be about to sign it in, while a read that came before is refused

/** Watch over the sign-in of one page. @param {Store} store */
export function watchSignIn(store) {
  const dialog = makeDialog();
  let asks = false;
  const ask = async () => {
    const known = await isSignedIn();
    asks = false;
    if (known === null) return; // the next refusal asks again
    signIn.over = !known;
    if (!known) dialog.showModal();
    store.set({ signed_out: !known });
  };
  signIn.addEventListener("refused", () => {
    if (signIn.over || asks) return;
    asks = true;
    setTimeout(() => void ask(), SETTLE_MS);
  });
  signIn.addEventListener("restored", () => {
    dialog.close();
    store.set({ signed_out: false });
  });
  const look = async () => {
    if (signIn.over && !document.hidden && (await isSignedIn())) signIn.restore();
  };
  window.addEventListener("focus", () => void look());
  document.addEventListener("visibilitychange", () => void look());
  dialog.addEventListener("close", () => signIn.over && dialog.showModal()); // Escape closes every dialog
}

/** Ask whether the server knows this browser; null when it does not say, as while it is away. */
async function isSignedIn() {
  try {
    return (await whoAmI()).kind !== "nobody";
  } catch (error) {
    if (error instanceof RequestError) return null;
    throw error;
  }
}

function makeDialog() {
  const dialog = h("dialog", { class: "sheet signed-out", role: "alertdialog", "aria-label": "You were signed out" });
  fill(
    dialog,
    html`<header><h2>You were signed out</h2></header>`,
    html`<p>The server does not accept this browser's sign-in any more. From here the rig can be neither moved nor stopped.</p>`,
    html`<p class="lead">
      To keep what you have typed here, <a href="/" target="_blank" rel="noopener">sign in in another tab</a>: this page
      then continues.
    </p>`,
    html`<div class="actions">
      <button type="button" class="plain primary" @click=${() => location.reload()}>Sign in</button>
    </div>`,
  );
  document.body.append(dialog);
  return dialog;
}
