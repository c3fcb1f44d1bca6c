// Requests and shows the depth of the shown moment, which the server computes.

import { RequestError } from "../api.js";
import { changing, h, say } from "../dom.js";
import { distanceText, number, sentence } from "../format.js";
import { icon } from "../icons.js";
import { makeDrawn } from "./drawn.js";
import { clockWords } from "./recording_words.js";

/**
 * @import { RecordedDepthDocument } from "#api"
 * @typedef {{waiting: boolean, refused: string, found: RecordedDepthDocument | null}} Now
 */

const FAR_APART_MS = 5;

/**
 * @param {string} id
 * @param {{orders: import("./recording_orders.js").RecordingOrders, at: () => number}} context `at`: returns the shown moment
 */
export function makeDepth(id, { orders, at }) {
  const button = h("button", { type: "button", class: "plain" }, icon("cube"), "Compute depth");
  const told = h("div", { class: "stack depth-told", role: "status" });
  const drawn = makeDrawn({ width: 720, height: 540 });
  drawn.element.hidden = true;
  const show = changing(told, (/** @type {Now} */ now) => wordsOf(now));
  const compute = async () => {
    if (button.disabled) return;
    const at_s = at();
    button.disabled = true;
    show({ waiting: true, refused: "", found: null });
    const answer = await orders.depth(id, at_s);
    button.disabled = false;
    const refused = answer instanceof RequestError;
    show({ waiting: false, refused: refused ? answer.message : "", found: refused ? null : answer });
    drawn.element.hidden = refused;
    if (!refused) drawn.show(answer.picture_url, `Depth at ${clockWords(answer.t_s)}`);
  };
  button.addEventListener("click", () => void compute());
  const stale = h("span", { class: "why" });
  return {
    element: h("div", { class: "stack" }, h("div", { class: "actions" }, button, stale), told, drawn.element),
    compute,
    move: (/** @type {number} */ at_s) => say(stale, `of the moment shown, ${clockWords(at_s)}`),
  };
}

/** @param {Now} now */
function wordsOf({ waiting, refused, found }) {
  if (waiting) return [h("p", { class: "lead", text: "Matching both foveae …" })];
  if (refused !== "") return [h("p", { class: "refused", text: sentence(refused) })];
  if (found === null) return [];
  const centre = found.z_m === null ? "Nothing could be matched at the centre" : distanceText(found.z_m, found.sigma_m);
  return [
    h(
      "p",
      { class: "depth-centre" },
      found.z_m === null ? sentence(centre) : [h("strong", { text: centre }), " at the centre of the left fovea"],
    ),
    h("p", {
      class: "why",
      text:
        [
          `At ${clockWords(found.t_s)}: ${number(100 * found.known, 0)} % of the pixels have depth`,
          found.verged_z_m === null ? "the eyes look parallel" : `the eyes meet at ${number(found.verged_z_m, 2)} m`,
          found.apart_ms > FAR_APART_MS
            ? `the eyes were exposed ${number(found.apart_ms, 0)} ms apart: what moves is wrong`
            : "",
        ]
          .filter(Boolean)
          .join("; ") + ".",
    }),
  ];
}
