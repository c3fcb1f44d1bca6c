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
  let now = { open: false, held: 0, asked: false };
  const ask = (/** @type {boolean} */ asked) => show({ ...now, asked });
  const button = (/** @type {string} */ name, /** @type {() => void} */ act, /** @type {string} */ more = "") =>
    h("button", { type: "button", class: `plain ${more}`, on: { click: act } }, name);
  const [question, face, words] = [h("span", { class: "why", role: "alert" }), h("span", { class: "face" }), h("span", {})];
  const empty = button("Empty the trash", () => ask(true));
  const sure = button("Delete for good", () => { ask(false); void orders.emptyTrash(); }, "danger");
  const keep = button("Keep", () => ask(false));
  const door = h("button", { type: "button", class: "plain", on: { click: () => turn(!now.open) } }, face, words);
  // These stay the same elements, so that no click is lost when the number changes under it.
  const show = (/** @type {typeof now} */ next) => {
    now = { ...next, asked: next.asked && next.open && next.held > 0 };
    const { open, held, asked } = now;
    say(question, asked ? `Delete ${held === 1 ? "this dataset" : `these ${count(held)} datasets`} for good?` : "");
    empty.hidden = asked || !open || held === 0;
    for (const each of [sure, keep]) each.hidden = !asked;
    if (face.dataset["open"] !== String(open)) fill(face, icon(open ? "back" : "trash"));
    face.dataset["open"] = String(open);
    say(words, open ? "Back to the datasets" : held > 0 ? `Trash (${count(held)})` : "Trash");
    door.setAttribute("aria-pressed", String(open));
  };
  const element = h("div", { class: "actions trash" }, question, empty, sure, keep, door);
  return { element, show: (/** @type {boolean} */ open, /** @type {number} */ held) => show({ open, held, asked: now.asked }) };
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
