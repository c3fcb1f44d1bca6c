// The section for a dataset's reference over the rail's long baselines: making it, its picture, figures and files.

import { allHold, choiceField, numberField, panel } from "../calibration/parts.js";
import { figure } from "../calibration/pictures.js";
import { changing, h } from "../dom.js";
import { icon } from "../icons.js";
import { whenWords } from "./dataset_words.js";
import { MadeOrders } from "./made_orders.js";
import { progressOf, refusalOf, troubleOf } from "./made_parts.js";
import { MadeReader } from "./made_reader.js";
import { referenceWords, wholeMm } from "./reference_words.js";

/**
 * @import { JobProgress, MadeReference, ReferenceDocument, ReferenceRequest, ReferenceStop } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 * @typedef {MadeOrders<ReferenceDocument, ReferenceRequest>} ReferenceOrders
 * @typedef {{made: MadeReference, outdated: boolean, idle: boolean}} Result
 * @typedef {{anew: boolean, stops: ReferenceStop[], brackets: number[]}} Offer
 */

/**
 * Build the section; hidden where fewer than two scans have a rail position.
 * @param {string} id
 * @param {GalleryContext} context
 */
export function makeReference(id, context) {
  /** @type {MadeReader<ReferenceDocument>} */
  const reader = new MadeReader(id, "reference", () => show());
  /** @type {ReferenceOrders} */
  const orders = new MadeOrders(id, "reference", { commands: context.commands, reader });
  const [trouble, refusal, progress, result, offer] = [
    h("div"),
    h("div"),
    h("div"),
    h("div", { class: "stack" }),
    h("div", { class: "stack" }),
  ];
  const showTrouble = changing(trouble, (/** @type {import("#api").Problem | null} */ why) =>
    why ? troubleOf(why, reader, "reference") : [],
  );
  const showRefusal = changing(refusal, (/** @type {import("#api").Problem | null} */ why) =>
    why ? refusalOf(why, "reference") : [],
  );
  const showProgress = changing(progress, (/** @type {{progress: JobProgress | null} | null} */ now) =>
    now ? progressOf(now.progress, orders, "reference") : [],
  );
  const showResult = changing(result, (/** @type {Result | null} */ now) => (now ? resultOf(now, orders) : []));
  const showOffer = changing(offer, (/** @type {Offer | null} */ now) => (now ? offerOf(now, orders) : []));
  const parts = [trouble, refusal, progress, result, offer];
  const element = panel("Depth against long baselines", h("div", { class: "making" }, parts));
  element.hidden = true;
  const show = () => {
    const { document: now, trouble: why } = reader;
    element.hidden = now === null || (now.stops.length < 2 && now.state === "none");
    if (now === null || element.hidden) return;
    const building = now.state === "building";
    showTrouble(building ? null : why);
    showRefusal(now.made || building ? null : now.refusal);
    showProgress(building ? { progress: now.progress } : null);
    showResult(now.made && { made: now.made, outdated: now.outdated, idle: !building });
    showOffer(building || now.refusal ? null : { anew: now.made !== null, stops: now.stops, brackets: now.brackets });
    for (const part of parts) part.hidden = part.childElementCount === 0;
  };
  context.follow(reader);
  return element;
}

/**
 * @param {Result} now
 * @param {ReferenceOrders} orders
 */
function resultOf({ made, outdated, idle }, orders) {
  const { svg_url, png_url, samples_url, made_utc } = made;
  const file = (/** @type {string} */ url, /** @type {string} */ text) =>
    h("a", { class: "plain", href: url, download: "" }, icon("down"), text);
  return [
    h("p", { text: referenceWords(made) }),
    h(
      "div",
      { class: "reference-plot" },
      figure({
        name: "reference",
        title:
          "Over depth: how far the rig's own depth is off the reference, and the error that the reference states; on the right in per cent.",
        url: svg_url,
      }),
    ),
    h(
      "p",
      { class: "actions" },
      file(svg_url, "SVG"),
      file(png_url, "PNG"),
      file(samples_url, "Samples (CSV)"),
      h(
        "button",
        {
          type: "button",
          class: "plain",
          disabled: !idle,
          data: { keep: "remove" },
          title: "The dataset stays; it can be made again",
          on: { click: () => void orders.remove() },
        },
        icon("trash"),
        "Remove",
      ),
    ),
    h("p", {
      class: outdated ? "warn-text" : "note",
      text: `Made ${whenWords(made_utc)}${outdated ? "; the dataset has grown since: make it anew" : ""}.`,
    }),
  ];
}

/**
 * @param {Offer} offer
 * @param {ReferenceOrders} orders
 */
function offerOf({ anew, stops, brackets }, orders) {
  const scan = choiceField("Depth of", [
    ["", "the scan nearest to the middle"],
    ...stops.map(
      ({ scan: number, rail_m }) =>
        /** @type {[string, string]} */ ([String(number), `scan ${number + 1}, at ${wholeMm(rail_m)}`]),
    ),
  ]);
  const bracket = choiceField(
    "Exposure",
    brackets.map((each) => [String(each), String(each + 1)]),
  );
  const across = numberField("Samples across a view", { value: 10, min: 2, max: 40 });
  const rail_mm = numberField("Error of a place on the rail", { value: 0.1, min: 0, max: 50, step: "any", unit: "mm" });
  const make = () => {
    if (!allHold(across, rail_mm)) return;
    void orders.make({
      scan: scan.value() === "" ? null : Number(scan.value()),
      bracket: Number(bracket.value()),
      across: across.value() ?? 10,
      rail_sigma_m: (rail_mm.value() ?? 0.1) / 1000,
    });
  };
  const fields = h(
    "div",
    { class: "fields" },
    scan.element,
    brackets.length > 1 && bracket.element,
    across.element,
    rail_mm.element,
  );
  const button = h(
    "button",
    { type: "button", class: anew ? "plain" : "plain primary", data: { keep: "make" }, on: { click: make } },
    anew ? "Make it anew" : "Make the reference",
  );
  if (anew)
    return [
      h(
        "details",
        {},
        h("summary", { text: "Make it anew" }),
        h("div", { class: "stack" }, fields, h("p", { class: "actions" }, button)),
      ),
    ];
  return [
    h("p", {
      class: "lead",
      text: "The depth of one scan is triangulated over the scans from the other places on the rail, and the rig's own depth compared with it. The rig stays free meanwhile.",
    }),
    h("details", {}, h("summary", { text: "Settings" }), fields),
    h("p", { class: "actions" }, button),
  ];
}
