// Shows the figures of a mosaic, its files, and its buttons.

import { figures } from "../calibration/parts.js";
import { changing, h } from "../dom.js";
import { count, pixels } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords } from "./dataset_words.js";
import { percent, size } from "./mosaic_words.js";

/**
 * @import { MadeMosaic, MosaicDocument } from "#api"
 * @import { MosaicOrders } from "./mosaic_orders.js"
 */

/** @param {MosaicOrders} orders */
export function makeFacts(orders) {
  const [actions, facts] = [h("div", { class: "actions" }), h("div", { class: "panel mosaic-facts" })];
  const showActions = changing(
    actions,
    (/** @type {{in_scene: boolean, idle: boolean, made: MadeMosaic} | null} */ now) =>
      now ? actionsOf(now, orders) : [],
  );
  const showFacts = changing(facts, (/** @type {MadeMosaic | null} */ made) =>
    made ? [h("div", { class: "inside" }, factsOf(made))] : [],
  );
  return {
    actions,
    element: facts,
    show: (/** @type {MosaicDocument} */ { made, in_scene, state }) => {
      facts.hidden = made === null;
      showActions(made && { in_scene, idle: state !== "building", made });
      showFacts(made);
    },
  };
}

/**
 * @param {{in_scene: boolean, idle: boolean, made: MadeMosaic}} now
 * @param {MosaicOrders} orders
 */
function actionsOf({ in_scene, idle, made }, orders) {
  const { glb_url, ply_url } = made;
  return [
    glb_url &&
      h(
        "button",
        {
          type: "button",
          class: in_scene ? "plain" : "plain primary",
          "aria-pressed": String(in_scene),
          data: { keep: "scene" },
          on: { click: () => void orders.show(!in_scene) },
        },
        icon("cube"),
        in_scene ? "Take out of 3D" : "Show in 3D",
      ),
    glb_url && h("a", { class: "plain", href: glb_url, download: "" }, icon("down"), "GLB"),
    ply_url && h("a", { class: "plain", href: ply_url, download: "" }, icon("down"), "PLY"),
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
  ];
}

/** @param {MadeMosaic} made */
function factsOf({ eye, views, width, height, tiles, size_bytes, seams, depth, made_utc }) {
  return [
    figures([
      ["Eye", eye],
      ["Foveae", count(views)],
      ["Size", size(width, height)],
      ["Tiles", `${count(tiles)}, ${sizeWords(size_bytes)} in all`],
      ["Made", new Date(made_utc).toLocaleString()],
    ]),
    figures([
      ["Seams", seams.after_rms_px === null ? null : `${pixels(seams.after_rms_px)} rms`],
      ["Measured at", `${count(seams.links)} places`],
      ["Depth known", percent(depth.known)],
      ["Seen by two pairs or more", percent(depth.seen_twice)],
      ["Pairs differ by", depth.between_pairs_rel_rms === null ? null : `${percent(depth.between_pairs_rel_rms)} rms`],
    ]),
    h("p", { class: "note", text: "Where no fovea saw, the wide view shows. Depth is where both eyes saw texture." }),
  ];
}
