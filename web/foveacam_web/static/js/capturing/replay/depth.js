// Requests and shows the depth of the shown moment, which the server computes.

import { RequestError, request } from "../../transport/api.js";
import { h, html, update } from "../../elements/dom.js";
import { distanceText, number, sentence } from "../../elements/format.js";
import "../gallery/drawn.js";
import { clockWords } from "../gallery/recording_words.js";
import { backendWords } from "../../video/depth_words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { DepthBackendDocument, DepthBackendsDocument, RecordedDepthDocument } from "#api"
 * @typedef {{waiting: boolean, refused: string, found: RecordedDepthDocument | null, backends: DepthBackendDocument[], backend: string, confirmed: boolean}} Now
 */

const FAR_APART_MS = 5;

/**
 * @param {string} id
 * @param {{orders: import("../gallery/recordings.js").RecordingOrders, at: () => number}} context `at`: returns the shown moment
 */
export function makeDepth(id, { orders, at }) {
  const element = h("div", { class: "stack" });
  /** @type {Now} */
  let now = { waiting: false, refused: "", found: null, backends: [], backend: "live", confirmed: false };
  let at_s = 0;
  const show = (/** @type {Partial<Now>} */ part) => {
    now = { ...now, ...part };
    const { found } = now;
    const research = now.backends.some(({ name, research_only }) => research_only && name === now.backend);
    update(
      element,
      html`${chooserOf(now, show)}
        ${
          research &&
          html`<label class="field tick"
            ><input
              type="checkbox" .checked=${now.confirmed}
              @change=${(/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget }) => show({ confirmed: currentTarget.checked })}
            /><span>This is research: its licence allows nothing else</span></label
          >`
        }
        <div class="actions">
          ${textButton("Compute depth", compute, {
            picture: "cube",
            disabled: now.waiting || (research && !now.confirmed),
          })}
          <span class="why">of the moment shown, ${clockWords(at_s)}</span>
        </div>
        <div class="stack depth-told" role="status">${wordsOf(now)}</div>
        ${found && html`<drawn-picture src=${found.picture_url} text="Depth at ${clockWords(found.t_s)}" width="720" height="540"></drawn-picture>`}`,
    );
  };
  const compute = async () => {
    if (now.waiting) return;
    show({ waiting: true, refused: "", found: null });
    const answer = await orders.depth(id, at(), { backend: now.backend, research_confirmed: now.confirmed });
    const refused = answer instanceof RequestError;
    show({ waiting: false, refused: refused ? answer.message : "", found: refused ? null : answer });
  };
  void request("GET", "/depth/backends")
    .then((found) => show({ backends: /** @type {DepthBackendsDocument} */ (found).backends }))
    .catch(() => {}); // the built-in one stays
  const move = (/** @type {number} */ moment_s) => {
    at_s = moment_s;
    show({});
  };
  return { element, compute, move };
}

/** Return the choice of the depth backend, once the list of backends has been read. @param {Now} now @param {(part: Partial<Now>) => void} show */
function chooserOf({ backends, backend }, show) {
  if (backends.length === 0) return null;
  return html`<label class="field"
    ><span>Computed by</span
    ><select
      .value=${backend}
      @change=${(/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => show({ backend: currentTarget.value, confirmed: false })}
    >
      ${backends.map(
        (each) =>
          html`<option value=${each.name} ?selected=${each.name === backend} ?disabled=${each.problem !== null}>
            ${backendWords(each)}
          </option>`,
      )}
    </select></label
  >`;
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
          `At ${clockWords(found.t_s)}, by ${found.backend}: ${number(100 * found.known, 0)} % of the pixels have depth`,
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
