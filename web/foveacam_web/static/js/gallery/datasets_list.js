// All datasets as cards, newest first, found by words; and the trash.

import { nothing } from "../calibration/parts.js";
import { changing, fill, h, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { makeCard } from "./dataset_card.js";
import { DatasetOrders } from "./dataset_orders.js";
import { sizeWords } from "./dataset_words.js";
import { DatasetsReader } from "./datasets_reader.js";

/**
 * @typedef {import("./context.js").GalleryContext} GalleryContext
 * @typedef {import("./documents.js").DatasetDocument} DatasetDocument
 * @typedef {import("./dataset_card.js").Card} Card
 */

const PAUSE_MS = 200; // while somebody types

/** @param {GalleryContext} context */
export function openList({ commands, follow, signal }) {
  let in_trash = false;
  const reader = new DatasetsReader(() => show());
  const orders = new DatasetOrders({ commands, changed: () => reader.readAll() });
  const [found, empty] = [h("p", { class: "why found", role: "status" }), h("div", {})];
  const list = h("ul", { class: "cards" });
  const showCards = cardsIn(list, orders);
  const showEmpty = changing(empty, (/** @type {string} */ words) => (words === "" ? [] : emptyOf(words)));
  const search = makeSearch((text) => void reader.search(text), signal);
  const trash = makeTrash(orders, (open) => {
    in_trash = open;
    search.hidden = open;
    show();
  });
  const show = () => {
    const shown = in_trash ? reader.trash : reader.list;
    trash.show(in_trash, reader.trash?.length ?? 0);
    showCards(shown ?? []);
    say(found, shown && shown.length > 0 ? summary(shown) : "");
    showEmpty(shown === null ? "Loading …" : shown.length > 0 ? "" : in_trash ? "The trash is empty." : reader.searched ? `No dataset holds “${reader.searched}”.` : "none");
  };
  follow(reader);
  return h("div", { class: "datasets" }, h("div", { class: "gallery-bar" }, search, found, trash.element), empty, list);
}

/** @param {DatasetDocument[]} shown */
function summary(shown) {
  const bytes = shown.reduce((sum, { size_bytes }) => sum + size_bytes, 0);
  return [`${count(shown.length)} ${shown.length === 1 ? "dataset" : "datasets"}`, bytes > 0 && sizeWords(bytes)].filter(Boolean).join(", ");
}

/** @param {string} words */
function emptyOf(words) {
  if (words !== "none") return [nothing(words)];
  return [nothing("No dataset yet."), h("p", { class: "lead" }, "A raster that is captured shows up here from its first point on. ", h("a", { href: "#/capture", text: "Plan a capture" }), ".")];
}

/**
 * @param {(text: string) => void} search
 * @param {AbortSignal} signal
 */
function makeSearch(search, signal) {
  const input = h("input", { type: "search", id: "dataset-search", maxlength: 200, placeholder: "Name, label, id or state", autocomplete: "off" });
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  input.addEventListener("input", () => {
    clearTimeout(later);
    later = setTimeout(() => search(input.value), PAUSE_MS);
  });
  signal.addEventListener("abort", () => clearTimeout(later));
  return h("div", { class: "search" }, h("label", { for: "dataset-search", text: "Search" }), input);
}

/**
 * The door to the trash, and the button that empties it, which asks first.
 * @param {DatasetOrders} orders
 * @param {(open: boolean) => void} turn
 */
function makeTrash(orders, turn) {
  let asked = false;
  /** @type {{open: boolean, held: number}} */
  let now = { open: false, held: 0 };
  const ask = (/** @type {boolean} */ sure) => {
    asked = sure;
    update();
  };
  const place = h("div", { class: "actions trash" });
  const open = (/** @type {boolean} */ wanted) => {
    asked = false;
    turn(wanted);
  };
  const show = changing(place, (/** @type {{open: boolean, held: number, asked: boolean}} */ shown) => [
    shown.open && shown.held > 0 && (shown.asked
      ? [h("span", { class: "why", role: "alert", text: `Delete ${shown.held === 1 ? "this dataset" : `these ${count(shown.held)} datasets`} for good?` }),
        h("button", { type: "button", class: "plain danger", data: { keep: "empty" }, on: { click: () => { ask(false); void orders.emptyTrash(); } } }, "Delete for good"),
        h("button", { type: "button", class: "plain", data: { keep: "keep" }, on: { click: () => ask(false) } }, "Keep")]
      : h("button", { type: "button", class: "plain", data: { keep: "empty" }, on: { click: () => ask(true) } }, "Empty the trash")),
    h("button", { type: "button", class: "plain", "aria-pressed": String(shown.open), data: { keep: "trash" }, on: { click: () => open(!shown.open) } },
      icon(shown.open ? "back" : "trash"), shown.open ? "Back to the datasets" : shown.held > 0 ? `Trash (${count(shown.held)})` : "Trash"),
  ].flat());
  const update = () => show({ ...now, asked });
  return { element: place, show: (/** @type {boolean} */ is_open, /** @type {number} */ held) => {
    now = { open: is_open, held };
    update();
  } };
}

/**
 * Cards in a list: those that stay keep their elements, so that nothing is lost under a pointer.
 * @param {HTMLElement} list
 * @param {DatasetOrders} orders
 */
function cardsIn(list, orders) {
  /** @type {Map<string, Card>} */
  let cards = new Map();
  return (/** @type {DatasetDocument[]} */ datasets) => {
    const keyed = datasets.map((dataset) => /** @type {const} */ ([`${dataset.removed} ${dataset.id} ${dataset.folder}`, dataset]));
    const known = cards;
    cards = new Map(keyed.map(([key]) => [key, known.get(key) ?? makeCard(orders)]));
    for (const [key, dataset] of keyed) cards.get(key)?.show(dataset);
    if ([...known.keys()].join("\n") === [...cards.keys()].join("\n")) return;
    const focused = document.activeElement;
    fill(list, ...[...cards.values()].map(({ element }) => element));
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus({ preventScroll: true });
  };
}
