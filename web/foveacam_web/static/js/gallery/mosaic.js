// The page of a dataset's mosaic: viewer of picture and depth, making it, its files, its surface in 3D.

import { badge, nothing } from "../calibration/parts.js";
import { changing, fill, h } from "../dom.js";
import { sentence } from "../format.js";
import { icon } from "../icons.js";
import { MadeReader } from "./made_reader.js";
import { makeFacts } from "./mosaic_facts.js";
import { makeMaking } from "./mosaic_making.js";
import { MosaicOrders } from "./mosaic_orders.js";
import { makeMix, makeReadout, makeScale, makeZoom } from "./mosaic_tools.js";
import { MosaicViewer } from "./mosaic_viewer.js";
import { galleryAddress } from "./route.js";

/**
 * @import { MadeMosaic, MosaicDocument } from "#api"
 * @import { GalleryPlace } from "#page"
 * @import { GalleryContext } from "./tabs.js"
 */

/**
 * @param {GalleryPlace} at
 * @param {GalleryContext} context
 */
export function openMosaic(at, context) {
  const id = at.id ?? "";
  /** @type {MadeReader<MosaicDocument>} */
  const reader = new MadeReader(id, "mosaic", () => show());
  const orders = new MosaicOrders(id, { commands: context.commands, reader });
  const page = makePage(id, orders, reader, context.signal);
  const place = h("div", { class: "mosaic-place" }, nothing("Loading …"));
  const show = () => {
    const { document: mosaic, missing } = reader;
    if (mosaic === null)
      return fill(
        place,
        nothing(sentence(missing)),
        h("p", { class: "lead" }, h("a", { href: galleryAddress("datasets"), text: "To the datasets" })),
      );
    if (place.firstChild !== page.element) fill(place, page.element);
    page.show(mosaic);
  };
  context.follow(reader);
  return place;
}

/**
 * @param {string} id
 * @param {MosaicOrders} orders
 * @param {MadeReader<MosaicDocument>} reader
 * @param {AbortSignal} signal
 */
function makePage(id, orders, reader, signal) {
  const name = h("div", { class: "name" });
  const showName = changing(name, (/** @type {{name: string, word: [string, string]}} */ now) => [
    h(
      "a",
      {
        class: "tool",
        href: galleryAddress("datasets", id),
        "aria-label": "Back to the dataset",
        title: "Back to the dataset",
      },
      icon("back"),
    ),
    h("h3", { text: `Mosaic of ${now.name}`, tabindex: "-1" }),
    badge(...now.word),
  ]);
  const making = makeMaking(orders, reader);
  const facts = makeFacts(orders);
  const picture = h("div", { class: "mosaic-picture" });
  const showPicture = changing(picture, (/** @type {MadeMosaic | null} */ made) =>
    made ? pictureOf(made, signal) : [],
  );
  const element = h(
    "article",
    { class: "mosaic-page" },
    h("header", { class: "mosaic-head" }, name, facts.actions),
    making.element,
    picture,
    facts.element,
  );
  return {
    element,
    show: (/** @type {MosaicDocument} */ mosaic) => {
      showName({ name: mosaic.name, word: wordOf(mosaic) });
      making.show(mosaic);
      facts.show(mosaic);
      picture.hidden = mosaic.made === null;
      showPicture(mosaic.made);
    },
  };
}

/**
 * @param {MosaicDocument} mosaic
 * @returns {[string, string]}
 */
function wordOf({ state, outdated, made, refusal }) {
  if (state === "building") return ["plain", made ? "being made anew" : "being made"];
  if (made) return outdated ? ["warn", "older than its dataset"] : ["good", "complete"];
  if (state === "unfinished") return ["warn", "unfinished"];
  return refusal ? ["warn", "not possible"] : ["plain", "not made yet"];
}

/**
 * @param {MadeMosaic} made
 * @param {AbortSignal} signal
 */
function pictureOf(made, signal) {
  const readout = makeReadout();
  const scale = makeScale(made);
  const zoom = makeZoom(() => viewer);
  const viewer = new MosaicViewer(made, {
    told: (reading) => {
      readout.show(reading);
      scale.show(reading?.z_m ?? null);
    },
    moved: zoom.show,
    signal,
  });
  const mix = makeMix((now) => {
    viewer.show(now);
    scale.element.classList.toggle("idle", now.shown === "picture");
  }, made.near_m !== null);
  mix.begin();
  watch(viewer, signal);
  return [
    h("div", { class: "mosaic-bar" }, mix.element, zoom.element),
    viewer.element,
    h("div", { class: "mosaic-bar" }, readout.element, scale.element),
  ];
}

/**
 * Mark the viewer while its tiles load.
 * @param {MosaicViewer} viewer
 * @param {AbortSignal} signal
 */
function watch(viewer, signal) {
  const look = setInterval(() => viewer.element.setAttribute("aria-busy", String(!viewer.settled)), 200);
  signal.addEventListener("abort", () => clearInterval(look));
}
