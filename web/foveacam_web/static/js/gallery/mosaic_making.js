// Starts the making of a mosaic: what it needs, why it cannot be made, its progress, its failure.

import { choiceField } from "../calibration/parts.js";
import { changing, h } from "../dom.js";
import { icon } from "../icons.js";
import { sizeWords } from "./dataset_words.js";
import { progressOf, refusalOf, troubleOf } from "./made_parts.js";
import { size } from "./mosaic_words.js";

/**
 * @import { MosaicDocument, MosaicNeedsDocument, MosaicRequest, Problem } from "#api"
 * @import { MosaicOrders } from "./mosaic_orders.js"
 * @typedef {{anew: boolean, begun: boolean, needs: MosaicNeedsDocument | null, scans: number[], brackets: number[], eye: "left" | "right"}} Offer
 */

/**
 * @param {MosaicOrders} orders
 * @param {import("./made_reader.js").MadeReader<MosaicDocument>} reader
 */
export function makeMaking(orders, reader) {
  const [trouble, refusal, offer, progress] = [h("div"), h("div"), h("div"), h("div")];
  const showTrouble = changing(trouble, (/** @type {Problem | null} */ problem) =>
    problem ? troubleOf(problem, reader, "mosaic") : [],
  );
  const showRefusal = changing(refusal, (/** @type {Problem | null} */ problem) =>
    problem ? refusalOf(problem, "mosaic") : [],
  );
  const showOffer = changing(offer, (/** @type {Offer | null} */ now) => (now ? offerOf(now, orders) : []));
  const showProgress = changing(progress, (/** @type {{progress: import("#api").JobProgress | null} | null} */ now) =>
    now ? progressOf(now.progress, orders, "mosaic") : [],
  );
  const element = h("div", { class: "making" }, trouble, refusal, offer, progress);
  return {
    element,
    show: (
      /** @type {MosaicDocument} */ { state, made, outdated, needs, refusal: why, progress: now, scans, brackets },
    ) => {
      const building = state === "building";
      showTrouble(building ? null : reader.trouble);
      showRefusal(made || building ? null : why);
      const possible = !building && needs !== null && (made === null || outdated);
      showOffer(
        possible
          ? { anew: made !== null, begun: state === "unfinished", needs, scans, brackets, eye: made?.eye ?? "left" }
          : null,
      );
      showProgress(building ? { progress: now } : null);
      for (const part of [trouble, refusal, offer, progress]) part.hidden = part.childElementCount === 0;
      element.hidden = [trouble, refusal, offer, progress].every((part) => part.hidden);
    },
  };
}

/**
 * @param {Offer} offer
 * @param {MosaicOrders} orders
 */
function offerOf({ anew, begun, needs, scans, brackets, eye }, orders) {
  const eyes = choiceField("Picture of", [
    ["left", "Left eye"],
    ["right", "Right eye"],
  ]);
  const scan = choiceField(
    "Scan",
    scans.map((each) => [String(each), String(each + 1)]),
  );
  const bracket = choiceField(
    "Exposure",
    brackets.map((each) => [String(each), String(each + 1)]),
  );
  eyes.input.value = eye;
  const wish = () => ({
    eye: /** @type {MosaicRequest["eye"]} */ (eyes.value()),
    scan: Number(scan.value()),
    bracket: Number(bracket.value()),
  });
  const words = anew
    ? "The dataset has grown since this mosaic was made. It stays until a new one is whole."
    : begun
      ? "A mosaic was begun. Making it goes on where it ended."
      : "All foveae of the dataset are laid into one picture at their own resolution, with the depth of all pairs. The rig stays free meanwhile.";
  return [
    h(
      "div",
      { class: anew ? "offer small" : "offer" },
      !anew && icon("pictures"),
      h("p", { class: "lead", text: words }),
      needs && needsOf(needs),
      h(
        "div",
        { class: "fields" },
        eyes.element,
        scans.length > 1 && scan.element,
        brackets.length > 1 && bracket.element,
        h(
          "button",
          {
            type: "button",
            class: "plain primary",
            data: { keep: "make" },
            on: { click: () => void orders.make(wish()) },
          },
          begun ? "Go on" : anew ? "Make it anew" : "Make the mosaic",
        ),
        begun &&
          h(
            "button",
            { type: "button", class: "plain", on: { click: () => void orders.remove() } },
            icon("trash"),
            "Throw it away",
          ),
      ),
    ),
  ];
}

/** @param {MosaicNeedsDocument} needs */
function needsOf({ views, width, height, needed_bytes, free_bytes }) {
  return h("p", {
    class: "number",
    text: `${views} foveae · ${size(width, height)} · up to ${sizeWords(needed_bytes)} on the disk (${sizeWords(free_bytes)} free)`,
  });
}
