// All stills as cards, newest first, found by words; and their trash.

import { nothing } from "../calibration/parts.js";
import { StillOrders } from "../capture/still_orders.js";
import { changing, h, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords } from "./dataset_words.js";
import { stillCard } from "./still_card.js";
import { StillsReader } from "./stills_reader.js";

/**
 * @typedef {import("./context.js").GalleryContext} GalleryContext
 * @typedef {import("../capture/still_documents.js").StillDocument} StillDocument
 */

const PAUSE_MS = 200; // while somebody types

/** @param {GalleryContext} context */
export function openStillsList({ commands, follow, signal }) {
  let in_trash = false;
  let asked = false;
  const reader = new StillsReader(() => show());
  const orders = new StillOrders({ commands, changed: () => reader.readAll() });
  const [found, empty, trash] = [h("p", { class: "why found", role: "status" }), h("div", {}), h("div", { class: "actions trash" })];
  const list = h("ul", { class: "cards" });
  const search = makeSearch((text) => void reader.search(text), signal);
  const showCards = changing(list, cardsOf(orders));
  const showEmpty = changing(empty, emptyOf);
  const turn = (/** @type {{open?: boolean, ask?: boolean}} */ { open = in_trash, ask = false }) => {
    [in_trash, asked] = [open, ask];
    show();
  };
  const showTrash = changing(trash, (/** @type {{open: boolean, held: number, asked: boolean}} */ now) => trashOf(now, orders, turn));
  const show = () => {
    const shown = in_trash ? reader.trash : reader.list;
    search.hidden = in_trash;
    showTrash({ open: in_trash, held: reader.trash?.length ?? 0, asked });
    showCards(shown ?? []);
    say(found, shown && shown.length > 0 ? summary(shown) : "");
    const words = shown === null ? "Loading …" : shown.length > 0 ? "" : in_trash ? "The trash is empty." : reader.searched ? `No still holds “${reader.searched}”.` : "none";
    showEmpty({ words, waiting: in_trash ? 0 : reader.waiting });
  };
  follow(reader);
  return h("div", { class: "datasets stills" }, h("div", { class: "gallery-bar" }, search, found, trash), empty, list);
}

/**
 * Cards of stills; those that did not change are the same elements, and load no picture again.
 * @param {StillOrders} orders
 */
function cardsOf(orders) {
  /** @type {Map<string, HTMLElement>} */
  let cards = new Map();
  return (/** @type {StillDocument[]} */ stills) => {
    const known = cards;
    cards = new Map(stills.map((still) => {
      const key = JSON.stringify(still);
      return [key, known.get(key) ?? stillCard(still, orders)];
    }));
    return [...cards.values()];
  };
}

/** @param {StillDocument[]} shown */
function summary(shown) {
  return `${count(shown.length)} ${shown.length === 1 ? "still" : "stills"}, ${sizeWords(shown.reduce((sum, { size_bytes }) => sum + size_bytes, 0))}`;
}

/** @param {{words: string, waiting: number}} now */
function emptyOf({ words, waiting }) {
  const there = h("a", { href: "#/capture", text: "Look at them" });
  return [
    waiting > 0 && h("p", { class: "strip warn" }, icon("info"), h("span", {}, `${count(waiting)} ${waiting === 1 ? "still was" : "stills were"} taken and neither kept nor discarded. `, there, ".")),
    words !== "" && nothing(words === "none" ? "No still yet." : words),
    words === "none" && h("p", { class: "lead" }, "A still is a stack of pictures of every camera, taken where the mirrors stand. ", h("a", { href: "#/capture", text: "Take one" }), "."),
  ];
}

/**
 * @param {(text: string) => void} search
 * @param {AbortSignal} signal
 */
function makeSearch(search, signal) {
  const input = h("input", { type: "search", id: "still-search", maxlength: 200, placeholder: "Name, label or id", autocomplete: "off" });
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  input.addEventListener("input", () => {
    clearTimeout(later);
    later = setTimeout(() => search(input.value), PAUSE_MS);
  });
  signal.addEventListener("abort", () => clearTimeout(later));
  return h("div", { class: "search" }, h("label", { for: "still-search", text: "Search" }), input);
}

/**
 * The door to the trash, and the button that empties it, which asks first.
 * @param {{open: boolean, held: number, asked: boolean}} now
 * @param {StillOrders} orders
 * @param {(to: {open?: boolean, ask?: boolean}) => void} turn
 */
function trashOf({ open, held, asked }, orders, turn) {
  const button = (/** @type {string} */ keep, /** @type {string} */ text, /** @type {() => void} */ act, danger = false) =>
    h("button", { type: "button", class: danger ? "plain danger" : "plain", data: { keep }, on: { click: act } }, text);
  const sure = () => {
    turn({});
    void orders.emptyTrash();
  };
  return [
    open && held > 0 && asked && h("span", { class: "why", role: "alert", text: `Delete ${held === 1 ? "this still" : `these ${count(held)} stills`} for good?` }),
    open && held > 0 && asked && button("empty", "Delete for good", sure, true),
    open && held > 0 && asked && button("keep", "Keep", () => turn({})),
    open && held > 0 && !asked && button("empty", "Empty the trash", () => turn({ ask: true })),
    h("button", { type: "button", class: "plain", "aria-pressed": String(open), data: { keep: "trash" }, on: { click: () => turn({ open: !open }) } },
      icon(open ? "back" : "trash"), open ? "Back to the stills" : held > 0 ? `Trash (${count(held)})` : "Trash"),
  ];
}
