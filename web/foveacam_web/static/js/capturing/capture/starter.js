// Fields for a capture's name, label, licence and format, and the start button. Above the button: refusals that
// belong to no field.

import { choiceField, keptButton } from "../../elements/parts.js";
import { changing, h, html } from "../../elements/dom.js";
import { sentence, timedName } from "../../elements/format.js";
import { blamed } from "./blame.js";
import { isCapturing } from "./state.js";
import { asked, textField } from "./parts.js";

/**
 * @import { CaptureRequest, Problem } from "#api"
 * @import { CodecName, DraftWords, PlanDraft, PlanRequest, Store, Trouble } from "#console"
 * @import { CaptureOrders } from "./orders.js"
 * @import { Troubles } from "./parts.js"
 */

// fields of the grid or of the text; only one of the two is visible
const OF_POINTS = new Set(["text", "size", "field", "centre"]);

/**
 * @param {{store: Store, orders: CaptureOrders, troubles: Troubles, plan: () => PlanRequest | null, source: () => PlanDraft["source"], changed: () => void}} context
 *   `plan`: null while it is incomplete
 */
export function makeStarter({ store, orders, troubles, plan, source, changed }) {
  const fields = makeFields(troubles);
  const above = h("div", { class: "above" });
  const showAbove = changing(above, (/** @type {string[]} */ refusals) =>
    refusals.map((words) => html`<p class="refused" role="alert">${sentence(words)}</p>`),
  );
  const start = keptButton("Start the capture", () => begin(), { kind: "plain primary start", picture: "pictures" });
  /** The refusal of the last start, until something changes. @type {Problem | null} */
  let refused = null;
  let sending = false;
  let faulty = false;
  const beside = h("span", { class: "why", hidden: true, text: "A capture runs: see above." });
  const element = h(
    "div",
    { class: "stack", on: { input: edited, change: edited } },
    fields.element,
    above,
    html`<p class="actions">${start}${beside}</p>`,
  );
  store.on(["capturing"], ({ capturing }) => {
    const running = isCapturing(capturing);
    if (running === !beside.hidden) return;
    beside.hidden = !running;
    enable();
  });

  function edited() {
    refused = null;
    changed();
  }

  async function begin() {
    const whole = plan();
    if (!whole || sending) return;
    sending = true;
    enable();
    refused = await orders.start(fields.wish(whole));
    sending = false;
    enable();
    if (!refused) fields.nextName();
    changed();
  }

  /** Show the faults that the editor and the server find in the plan. @param {Trouble[]} own */
  function showTroubles(own) {
    const { problem, stale } = store.state.estimate;
    const of = (/** @type {Problem | null} */ document) => (document ? blamed(document, source()) : []);
    const estimated = of(problem).filter(
      ({ place }) => !stale || !OF_POINTS.has(place ?? "") || (place === "text") === (source() === "set_points"),
    );
    showAbove(troubles.show(distinct([...own, ...of(refused), ...estimated])));
    faulty = own.length > 0 || problem?.status === 422;
    enable();
  }

  function enable() {
    start.disabled = sending || faulty || !beside.hidden;
  }

  return { element, showTroubles, read: fields.read, put: fields.put, forget: () => (refused = null) };
}

/** @param {Troubles} troubles */
function makeFields(troubles) {
  const name = textField("Name", { value: timedName("raster") });
  const label = textField("Label", { placeholder: "what it shows" });
  const licence = textField("Licence", { value: "all rights reserved" });
  const codec = choiceField("Images as", [
    ["tiff", "TIFF, keeps the full pace"],
    ["png", "PNG, half the room"],
  ]);
  const element = h(
    "div",
    { class: "stack" },
    asked([name.element], troubles.place("name")),
    asked([label.element], troubles.place("label")),
    asked([licence.element], troubles.place("licence")),
    asked([codec.element]),
  );
  let given = name.value();
  /** @returns {DraftWords} */
  const read = () => ({
    name: name.value() === given ? "" : name.value(),
    label: label.value(),
    licence: licence.value(),
    codec: /** @type {CodecName} */ (codec.value()),
  });
  return {
    element,
    /** @param {PlanRequest} plan @returns {CaptureRequest} */
    wish: (plan) => ({ ...read(), name: name.value(), plan }),
    read,
    /** @param {DraftWords} words */
    put: (words) => {
      name.input.value = words.name || given;
      label.input.value = words.label;
      licence.input.value = words.licence;
      codec.put(words.codec);
    },
    nextName: () => {
      if (name.value() === given) name.input.value = given = timedName("raster");
    },
  };
}

/** @param {Trouble[]} troubles */
function distinct(troubles) {
  return troubles.filter(
    ({ place, words }, index) => troubles.findIndex((each) => each.place === place && each.words === words) === index,
  );
}
