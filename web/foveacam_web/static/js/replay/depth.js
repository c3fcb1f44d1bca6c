// Requests and shows the depth of the shown moment, which the server computes.

import { RequestError } from "../api.js";
import { h, html, update } from "../dom.js";
import { distanceText, number, sentence } from "../format.js";
import { icon } from "../icons.js";
import "../gallery/drawn.js";
import { clockWords } from "../gallery/recording_words.js";

/**
 * @import { RecordedDepthDocument } from "#api"
 * @typedef {{waiting: boolean, refused: string, found: RecordedDepthDocument | null}} Now
 */

const FAR_APART_MS = 5;

/**
 * @param {string} id
 * @param {{orders: import("../gallery/recordings.js").RecordingOrders, at: () => number}} context `at`: returns the shown moment
 */
export function makeDepth(id, { orders, at }) {
  const element = h("div", { class: "stack" });
  /** @type {Now} */
  let now = { waiting: false, refused: "", found: null };
  let at_s = 0;
  const show = (/** @type {Partial<Now>} */ part) => {
    now = { ...now, ...part };
    const { found } = now;
    update(
      element,
      html`<div class="actions">
          <button type="button" class="plain" ?disabled=${now.waiting} @click=${compute}>${icon("cube")}Compute depth</button>
          <span class="why">of the moment shown, ${clockWords(at_s)}</span>
        </div>
        <div class="stack depth-told" role="status">${wordsOf(now)}</div>
        ${found && html`<drawn-picture src=${found.picture_url} text="Depth at ${clockWords(found.t_s)}" width="720" height="540"></drawn-picture>`}`,
    );
  };
  const compute = async () => {
    if (now.waiting) return;
    show({ waiting: true, refused: "", found: null });
    const answer = await orders.depth(id, at());
    const refused = answer instanceof RequestError;
    show({ waiting: false, refused: refused ? answer.message : "", found: refused ? null : answer });
  };
  const move = (/** @type {number} */ moment_s) => {
    at_s = moment_s;
    show({});
  };
  return { element, compute, move };
}

/** @param {Now} now */
function wordsOf({ waiting, refused, found }) {
  if (waiting) return [html`<p class="lead">Matching both foveae …</p>`];
  if (refused !== "") return [html`<p class="refused">${sentence(refused)}</p>`];
  if (found === null) return [];
  const centre = found.z_m === null ? "Nothing could be matched at the centre" : distanceText(found.z_m, found.sigma_m);
  return [
    html`<p class="depth-centre">
      ${found.z_m === null ? sentence(centre) : [html`<strong>${centre}</strong>`, " at the centre of the left fovea"]}
    </p>`,
    html`<p class="why">
      ${
        [
          `At ${clockWords(found.t_s)}: ${number(100 * found.known, 0)} % of the pixels have depth`,
          found.verged_z_m === null ? "the eyes look parallel" : `the eyes meet at ${number(found.verged_z_m, 2)} m`,
          found.apart_ms > FAR_APART_MS
            ? `the eyes were exposed ${number(found.apart_ms, 0)} ms apart: what moves is wrong`
            : "",
        ]
          .filter(Boolean)
          .join("; ") + "."
      }
    </p>`,
  ];
}
