// The page of one still: the pictures of all cameras at 8 bits and at full depth, details, and buttons.

import { figures, nothing, panel } from "../calibration/parts.js";
import { StillOrders } from "../capture/still_orders.js";
import { picturesOf } from "../capture/still_shown.js";
import { CAMERAS, crossingWords, missingWords, stillWords } from "../capture/still_words.js";
import { changing, fill, h } from "../dom.js";
import { angle, millis, number, sentence } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords, whenWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";
import { makeEditable } from "./editable.js";
import { galleryAddress } from "./route.js";
import { OneStillReader } from "./still_reader.js";
import { makeStillCheck } from "./still_check.js";

/**
 * @import { StillCamera, StillDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 */

/**
 * @param {string} id
 * @param {GalleryContext} context
 */
export function openStill(id, context) {
  const reader = new OneStillReader(id, () => show());
  const page = makePage(new StillOrders(context), reader);
  const place = h("div", { class: "dataset" }, nothing("Loading …"));
  const show = () => {
    const { still, missing } = reader;
    if (still === null)
      return fill(
        place,
        nothing(sentence(missing)),
        h(
          "p",
          { class: "lead" },
          "It may be in the trash. ",
          h("a", { href: galleryAddress("stills"), text: "To the stills" }),
          ".",
        ),
      );
    if (place.firstChild !== page.element) fill(place, page.element);
    page.show(still);
  };
  context.follow(reader);
  return place;
}

/**
 * @param {StillOrders} orders
 * @param {OneStillReader} reader
 */
function makePage(orders, reader) {
  const [head, pictures, pair, facts, table] = [
    h("header", { class: "dataset-head" }),
    h("div", { class: "still-pictures" }),
    h("div", {}),
    h("div", {}),
    h("div", {}),
  ];
  const label = makeEditable("Label", {
    hint: "a line for people",
    save: async (value) => {
      const now = reader.still && (await orders.describe(reader.still.id, { label: value }));
      if (now) reader.adopt(now);
      return Boolean(now);
    },
  });
  const check = makeStillCheck(orders);
  const parts = /** @type {((still: StillDocument) => void)[]} */ ([
    changing(head, (still) => headOf(still, orders)),
    changing(pictures, picturesOf),
    changing(pair, pairOf),
    changing(facts, factsOf),
    changing(table, camerasOf),
  ]);
  const element = h(
    "article",
    { class: "dataset-page still-page" },
    head,
    h(
      "div",
      { class: "dataset-body" },
      h("div", { class: "column" }, panel("Pictures", pictures), pair),
      h(
        "div",
        { class: "column" },
        panel("About", h("div", { class: "stack" }, label.element, facts)),
        panel("Cameras", table),
        panel("Check", check.element),
      ),
    ),
  );
  return {
    element,
    show: (/** @type {StillDocument} */ still) => {
      for (const showPart of parts) showPart(still);
      label.show(still.label);
      check.show(still);
    },
  };
}

/**
 * @param {StillDocument} still
 * @param {StillOrders} orders
 */
function headOf(still, orders) {
  const back = galleryAddress("stills");
  const remove = async () => {
    if (await orders.trash.remove(still)) location.hash = back;
  };
  const readable = still.trouble === "";
  const wrong = readable ? missingWords(still) : [sentence(still.trouble)];
  return [
    h(
      "div",
      { class: "name" },
      h(
        "a",
        { class: "tool", href: back, "aria-label": "Back to the stills", title: "Back to the stills" },
        icon("back"),
      ),
      h("h3", { text: still.name, tabindex: "-1" }),
    ),
    h(
      "div",
      { class: "actions" },
      still.state === "held" &&
        h(
          "button",
          {
            type: "button",
            class: "plain primary",
            data: { keep: "keep" },
            on: { click: () => void orders.keep(still.id, "") },
          },
          icon("check"),
          "Keep",
        ),
      readable &&
        h(
          "a",
          { class: "plain", href: `${still.url}/download.zip`, download: `${still.name}.zip` },
          icon("down"),
          "Download ZIP",
        ),
      h(
        "button",
        {
          type: "button",
          class: "plain",
          data: { keep: "remove" },
          title: "It can be restored until the trash is emptied",
          on: { click: () => void remove() },
        },
        icon("trash"),
        "Put in the trash",
      ),
    ),
    h(
      "div",
      { class: "far" },
      [...wrong, ...still.warnings.map(sentence)].map((text) =>
        h("p", { class: readable ? "strip warn" : "strip bad" }, icon("warn"), text),
      ),
    ),
  ];
}

/** @param {StillDocument} still */
function pairOf({ cameras, calibration_id, url }) {
  const both = cameras.filter(({ camera, came }) => camera !== "wide" && came > 0).length === 2;
  if (!both || calibration_id === null) return [];
  const drawn = makeDrawn({ width: 720, height: 540 });
  drawn.show(`${url}/anaglyph.jpg`, "Both eyes, rectified, in red and cyan");
  return [
    panel(
      "Both eyes",
      h(
        "figure",
        { class: "cover-map" },
        drawn.element,
        h("figcaption", { text: "Rectified: left in red, right in green and blue." }),
      ),
    ),
  ];
}

/** @param {StillDocument} still */
function factsOf(still) {
  const pan = still.pan_deg === null ? "" : `${angle(still.pan_deg)}, ${angle(still.tilt_deg)}`;
  return [
    figures(
      /** @type {[string, string][]} */ ([
        ["Taken", whenWords(still.created_utc)],
        ["What", stillWords(still)],
        ["Gazes cross", still.calibration_id === null ? "" : crossingWords(still)],
        ["Rail", still.rail_mm === null ? "" : `${number(still.rail_mm, 1)} mm`],
        ["Pan, tilt", pan],
        ["Size", sizeWords(still.size_bytes)],
        ["Rig", still.rig_id ?? ""],
        ["Calibration", still.calibration_id ?? ""],
        ["Id", still.id],
        ["Folder", still.folder],
      ]).filter(([, value]) => value !== ""),
    ),
  ];
}

/** @param {StillDocument} still */
function camerasOf(still) {
  return still.cameras.map((camera) =>
    h(
      "section",
      { class: "still-camera" },
      h("h4", { text: CAMERAS[camera.camera] }),
      figures(cameraRows(camera)),
      camera.came > 0 &&
        h(
          "p",
          { class: "actions" },
          /** @type {const} */ (["png", "tiff"]).map((form) =>
            h(
              "a",
              {
                class: "plain",
                href: `${still.url}/cameras/${camera.camera}.${form}`,
                download: `${still.name} ${camera.camera}.${form}`,
              },
              icon("down"),
              `${camera.bits > 8 ? "Full depth" : "Picture"}, ${form.toUpperCase()}`,
            ),
          ),
        ),
    ),
  );
}

/**
 * @param {StillCamera} camera
 * @returns {[string, string][]}
 */
function cameraRows({ asked, came, width, height, bits, exposure_ms, gain_db, x_v, y_v, ax_deg, ay_deg }) {
  return /** @type {[string, string][]} */ ([
    ["Frames", came === asked ? String(came) : `${came} of ${asked}`],
    ["Size", came > 0 ? `${width} × ${height} px, ${bits} bits` : ""],
    ["Exposure", exposure_ms === null ? "" : millis(exposure_ms)],
    ["Gain", gain_db === null ? "" : `${number(gain_db, 1)} dB`],
    ["Looked", ax_deg === null ? "" : `${angle(ax_deg)} across, ${angle(ay_deg)} down`],
    ["Mirror", x_v === null ? "" : `${number(x_v, 2)} V, ${number(y_v, 2)} V`],
  ]).filter(([, value]) => value !== "");
}
