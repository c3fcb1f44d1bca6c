// Present from the start on every page with live views: the stop button, and the strip shown while the server is away.

import { fill, h, html, setText } from "../elements/dom.js";
import { clockTime } from "../elements/format.js";
import { icon } from "../elements/icons.js";

/**
 * @import { Commands, Store } from "#console"
 */

/**
 * Connect the stop button and the strip shown while the mirrors are stopped.
 * @param {HTMLElement} button
 * @param {HTMLElement} strip
 * @param {{store: Store, commands: Commands}} context
 */
export function mountStop(button, strip, { store, commands }) {
  button.addEventListener("click", () => void commands.stop());
  const text = h("span", {});
  const release = html`<button type="button" class="plain" @click=${() => void commands.releaseStop()}>Release</button>`;
  fill(strip, icon("warn"), text, release);
  store.on(["stop"], ({ stop }) => {
    const engaged = Boolean(stop?.engaged);
    strip.hidden = !engaged;
    button.classList.toggle("engaged", engaged);
    button.setAttribute("aria-pressed", String(engaged));
    const by = [stop?.by && `by ${stop.by}`, stop?.since_utc && `at ${clockTime(stop.since_utc)}`]
      .filter(Boolean)
      .join(" ");
    setText(text, engaged ? `Stopped ${by}: the mirrors are parked and take no orders.` : "");
  });
}

/** Show a strip while the server is away. @param {HTMLElement} strip @param {Store} store */
export function mountOffline(strip, store) {
  const text = html`<span>No connection to the server. The page shows what was last known and reconnects by itself.</span>`;
  fill(strip, html`<span class="spinner" aria-hidden="true"></span>`, text);
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  store.on(["stream", "signed_out"], ({ stream, signed_out }) => {
    clearTimeout(later);
    if (stream !== "down" || signed_out) strip.hidden = true;
    else later = setTimeout(() => (strip.hidden = false), 600); // a short interruption shows no banner
  });
}
