// Shows what the server warns of in a plan, and offers plans whose views overlap where these do not.

import { changing, html } from "../../elements/dom.js";
import { count, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { textButton } from "../../elements/parts.js";
import { denserGrid, OVERLAP_PERCENT, OVERLAPPING } from "./plan.js";

/**
 * @import { PlanDraft, Store, ViewSize } from "#console"
 * @typedef {{warnings: string[], gaps: boolean, denser: {columns: number, rows: number} | null}} Shown
 */

const DENSEST = 2000; // a plan of more points is not offered: it takes minutes

/**
 * @param {HTMLElement} place
 * @param {{store: Store, view: () => ViewSize | null, change: (draft: Partial<PlanDraft>) => void}} context
 *   `view`: size of one view, null until it is known
 */
export function mountWarnings(place, { store, view, change }) {
  const show = changing(place, (/** @type {Shown} */ shown) => warningsOf(shown, change));
  store.on(["estimate"], ({ estimate: { document } }) => {
    const points = document?.plan.points;
    const size = view();
    const gaps =
      points?.kind === "grid" && [document?.coverage.overlap_across, document?.coverage.overlap_down].includes(0);
    const denser = gaps && size ? denserGrid(points, size) : null;
    show({
      warnings: document?.warnings ?? [],
      gaps,
      denser: denser && denser.columns * denser.rows <= DENSEST ? denser : null,
    });
  });
}

/** @param {Shown} shown @param {(draft: Partial<PlanDraft>) => void} change */
function warningsOf({ warnings, gaps, denser }, change) {
  if (warnings.length === 0) return null;
  const overlap = `${OVERLAP_PERCENT} %`;
  return html`<div class="warnings">
    <ul>${warnings.map((words) => html`<li>${icon("warn")}<span>${sentence(words)}</span></li>`)}</ul>
    ${
      gaps &&
      html`<p class="actions">
        ${textButton(`Smaller field, views overlap by ${overlap}`, () => change(OVERLAPPING))}
        ${
          denser &&
          textButton(`Same field, ${count(denser.columns * denser.rows)} points that overlap by ${overlap}`, () =>
            change(denser),
          )
        }
      </p>`
    }
  </div>`;
}
