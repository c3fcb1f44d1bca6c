// Shows the captured views of the board: thumbnails with their error; each can be removed.

import { changing, fill, h, html } from "../../../elements/dom.js";
import { MISSING, number, pixels } from "../../../elements/format.js";
import { icon } from "../../../elements/icons.js";
import { nothing, toolButton } from "../../../elements/parts.js";
import { isRunning } from "../state.js";

/**
 * @import { SessionDocument, WideSampleDocument } from "#api"
 * @import { WizardContext } from "../page.js"
 */

const MUCH = 1.8; // times the median: the error of an outlier

/**
 * @param {HTMLElement} place
 * @param {{store: WizardContext["store"], samplesOf: (session: SessionDocument | null) => WideSampleDocument[],
 *   remove: (id: string) => unknown}} context
 * @returns {{show: () => void}} shows them again, when `samplesOf` returns others without a change of the session
 */
export function mountSamples(place, { store, samplesOf, remove }) {
  const list = h("ul", { class: "samples", "aria-label": "Views taken" });
  const empty = h(
    "div",
    {},
    nothing("None yet. Each view that is taken appears here with its error; one that spoils the fit can be removed."),
  );
  fill(place, empty, list);
  const show = changing(list, (/** @type {{samples: WideSampleDocument[], busy: boolean}} */ { samples, busy }) => {
    const limit = MUCH * median(samples.flatMap(({ rms_px }) => (rms_px === null ? [] : [rms_px])));
    return samples.map((sample, index) =>
      card(sample, { index, far: (sample.rms_px ?? 0) > limit, busy, remove: () => remove(sample.id) }),
    );
  });
  const showAll = () => {
    const { session, work } = store.state;
    const samples = samplesOf(session);
    empty.hidden = samples.length > 0;
    show({ samples, busy: isRunning(work) });
  };
  store.on(["session", "work"], showAll);
  return { show: showAll };
}

/**
 * @param {WideSampleDocument} sample
 * @param {{index: number, far: boolean, busy: boolean, remove: () => unknown}} how `far`: its error is an outlier
 */
function card(sample, { index, far, busy, remove }) {
  const words = [
    sample.rms_px === null ? "" : pixels(sample.rms_px),
    sample.tilt_deg === null ? "" : `tilt ${number(sample.tilt_deg, 0)}°`,
  ];
  return html`<li class=${far ? "far" : ""}>
    <img
      src=${sample.thumbnail_url} alt="View ${index + 1}: ${sample.corners} corners" loading="lazy" width="144"
      height="108"
    />
    <span
      class="error number"
      title=${
        far ? "Much larger than the others: look whether the board was blurred or bent" : `${sample.corners} corners`
      }
    >
      ${far && icon("warn")}
      ${words.filter(Boolean).join(", ") || MISSING}
    </span>
    ${toolButton(`Remove view ${index + 1}`, "trash", () => remove(), {
      title: busy ? "Not while something runs" : "Remove and fit again",
      disabled: busy,
    })}
  </li>`;
}

/** @param {number[]} values */
function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? Infinity;
}
