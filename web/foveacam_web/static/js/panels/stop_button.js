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
  keepOnTop(button);
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

/**
 * Keep a button usable while dialogs are open: a modal one makes all of the page inert that is not in it, so that the
 * button moves into the topmost, and stays at its place on the screen.
 * @param {HTMLElement} button
 */
function keepOnTop(button) {
  const gap = h("span", { class: "stop-gap", "aria-hidden": "true" });
  /** @type {Element[]} the open dialogs, the topmost last */
  let open = [];
  const place = () => {
    const top = open.at(-1);
    if (top ? button.parentElement === top : !gap.isConnected) return;
    if (!top) {
      button.removeAttribute("style");
      gap.replaceWith(button);
      return;
    }
    if (!gap.isConnected) {
      const { width, height } = button.getBoundingClientRect();
      Object.assign(gap.style, { width: `${width}px`, height: `${height}px` });
      button.replaceWith(gap);
    }
    top.append(button);
    align();
  };
  const align = () => {
    if (!gap.isConnected) return;
    const { left, top, width, height } = gap.getBoundingClientRect();
    Object.assign(button.style, {
      position: "fixed",
      inset: `${top}px auto auto ${left}px`,
      width: `${width}px`,
      height: `${height}px`,
    });
  };
  new MutationObserver(() => {
    const now = [...document.querySelectorAll("dialog:modal")];
    open = [...open.filter((each) => now.includes(each)), ...now.filter((each) => !open.includes(each))];
    place();
  }).observe(document.body, { subtree: true, childList: true, attributeFilter: ["open"] });
  window.addEventListener("resize", align);
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
