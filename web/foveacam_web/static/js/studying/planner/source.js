// Chooses the map: random, open ground, the user's GeoJSON, the user's picture.

import { keptButton, numberField } from "../../elements/parts.js";
import { segments } from "../../capturing/capture/parts.js";
import { h, html, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { makePictureSheet, pictureOf } from "./picture.js";

/**
 * @import { MapKind, MapSettings } from "#page"
 * @typedef {{body: object, name: string, picture: string | null, kind: MapKind}} Given what a user gives as a map
 * @typedef {{
 *   place: HTMLElement, changed: (part: Partial<MapSettings>) => void, give: (given: Given) => Promise<string | null>
 * }} Options `give`: why the server does not take it, null when it does
 */

/** @type {[MapKind, string][]} */
const KINDS = [
  ["random", "Random"],
  ["open", "Open"],
  ["geojson", "GeoJSON"],
  ["picture", "Picture"],
];
const LAST_SEED = 2 ** 31;

/** @param {Options} options */
export function makeSource({ place, changed, give }) {
  const kinds = segments("Map", KINDS);
  const seed = numberField("Seed", { min: 0, step: 1 });
  const size = numberField("Side", { min: 1, step: "any", unit: "m" });
  const obstacles = numberField("Obstacles", { min: 0, step: 1 });
  const targets = numberField("Targets", { min: 1, step: 1 });
  /** @type {[keyof MapSettings, import("../../elements/parts.js").NumberField][]} */
  const numbers = [
    ["seed", seed],
    ["size_m", size],
    ["obstacles", obstacles],
    ["targets", targets],
  ];
  for (const [name, field] of numbers)
    field.input.addEventListener("input", () => changed({ [name]: field.input.valueAsNumber }));
  const another = keptButton("Another", () => changed({ seed: Math.floor(Math.random() * LAST_SEED) }), {
    picture: "again",
  });
  const files = makeFiles(give);
  const name = h("p", { class: "why", role: "status" });
  const drawn = h("div", { class: "fields" }, seed.element, another, size.element, obstacles.element, targets.element);
  const element = h(
    "div",
    { class: "stack asked-for" },
    kinds.element,
    drawn,
    files.geojson,
    files.picture,
    name,
    place,
  );
  kinds.element.addEventListener("change", () => changed({ kind: kinds.value() }));
  return {
    element,
    show: (/** @type {MapSettings} */ wish, /** @type {string} */ given) => {
      for (const [which, field] of numbers) {
        const value = wish[which];
        if (document.activeElement !== field.input && field.input.valueAsNumber !== value)
          field.input.value = String(value);
      }
      for (const input of kinds.element.querySelectorAll("input")) input.checked = input.value === wish.kind;
      drawn.hidden = wish.kind !== "random" && wish.kind !== "open";
      for (const each of [seed.element, another, obstacles.element, targets.element])
        each.hidden = wish.kind !== "random";
      files.geojson.hidden = wish.kind !== "geojson";
      files.picture.hidden = wish.kind !== "picture";
      name.hidden = drawn.hidden === false || given === "";
      setText(name, `In use: ${given}`);
    },
  };
}

/** @param {(given: Given) => Promise<string | null>} give */
function makeFiles(give) {
  const refused = h("p", { class: "refused", role: "alert" });
  const unit = numberField("One unit is", { value: 1, min: 0, step: "any", unit: "m" });
  /** @type {{document: object, name: string} | null} */
  let read = null;
  const send = async () => {
    if (!read) return;
    const why = await give({
      kind: "geojson",
      name: read.name,
      picture: null,
      body: { kind: "geojson", document: read.document, m_per_unit: unit.value() ?? 0 },
    });
    setText(refused, sentence(why));
  };
  unit.input.addEventListener("change", () => void send());
  const geojson = h(
    "div",
    { class: "stack" },
    html`<p class="why">
      Polygons are obstacles; points with the property kind “target” are targets; a polygon of kind “bounds” is the
      map’s edge.
    </p>`,
    html`<div class="fields">
      ${unit.element}
      ${fileButton("Load GeoJSON", ".geojson,.json,application/json,application/geo+json", async (file) => {
        const document = objectOf(await file.text());
        if (!document)
          return setText(refused, `“${file.name}” is no JSON document: it may be cut short, or another kind of file.`);
        read = { document, name: file.name };
        await send();
      })}
    </div>`,
    refused,
  );
  const unread = h("p", { class: "refused", role: "alert" });
  const ask = makePictureSheet(({ name, url }, m_per_px) => {
    const body = { kind: "picture", picture_base64: url.slice(url.indexOf(",") + 1), m_per_px };
    return give({ kind: "picture", name, picture: url, body });
  });
  const picture = h(
    "div",
    { class: "stack" },
    html`<p class="why">A plan or a view from above as PNG or JPEG: dark is where something stands.</p>`,
    fileButton("Load a picture", "image/png,image/jpeg", async (file) => {
      const found = await pictureOf(file);
      setText(unread, found ? "" : `“${file.name}” is no picture that this browser can read: choose a PNG or a JPEG.`);
      if (found) ask(found);
    }),
    unread,
  );
  return { geojson, picture };
}

/** @param {string} label @param {string} accept @param {(file: File) => Promise<void>} take */
function fileButton(label, accept, take) {
  const input = h("input", {
    type: "file",
    accept,
    class: "unseen",
    "aria-label": label,
    on: {
      change: () => {
        const file = input.files?.[0];
        input.value = ""; // so that the same file can be selected again
        if (file) void take(file);
      },
    },
  });
  return html`<label class="plain file">${icon("file")}${label}${input}</label>`;
}

/** @param {string} text @returns {object | null} */
function objectOf(text) {
  try {
    const document = /** @type {unknown} */ (JSON.parse(text));
    return document && typeof document === "object" && !Array.isArray(document) ? document : null;
  } catch {
    return null;
  }
}
