// The server's picture of the loop's match: while shown, loaded again after a new look, at most once a second.

import { h, html, update } from "../../elements/dom.js";
import "../../capturing/gallery/drawn.js";
import { API } from "../../root.js";

/**
 * @import { ConsoleState, Store } from "#console"
 */

const LEAST_MS = 1000;
const URL = `${API}/loop/match.png`;
const ALTERNATIVE = "The strip of the wide view with both eyes' boxes, and each eye's correlation";

/** @param {Store} store */
export function matchPicture(store) {
  const picture = h("div", {});
  const details = h(
    "details",
    { class: "panel loop-match", on: { toggle: () => show(store.state) } },
    html`<summary>What the loop matches</summary>`,
    html`<p class="lead">
      The strip of the wide view in which both foveae are located: the yellow cross is the target, the boxes show where
      each fovea was found. Below, the correlation of each eye with every position in the strip.
    </p>`,
    picture,
  );
  let [loaded_ms, drawn] = [-Infinity, ""];
  const show = (/** @type {ConsoleState} */ { loop_page, loop }) => {
    const open = details.open && loop_page && !document.hidden;
    if (!open || !loop || loop.score_left === null) return;
    const look = `${loop.job_id}-${loop.looks}`;
    const early = performance.now() - loaded_ms < LEAST_MS || picture.querySelector("[aria-busy]") !== null;
    if (look === drawn || early) return;
    [loaded_ms, drawn] = [performance.now(), look];
    update(picture, html`<drawn-picture src=${`${URL}?look=${look}`} text=${ALTERNATIVE}></drawn-picture>`);
  };
  store.on(["loop", "loop_page"], show);
  return details;
}
