// Lists the stills as cards, newest first, with a text search and the trash.

import { nothing } from "../calibration/parts.js";
import { StillOrders } from "../capture/still_orders.js";
import { changing, h, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords } from "./dataset_words.js";
import { makeSearch, makeTrashDoor } from "./list_parts.js";
import { stillCard } from "./still_card.js";
import { StillsReader } from "./stills_reader.js";

/**
 * @import { StillDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 */

/** @param {GalleryContext} context */
export function openStillsList({ commands, follow, signal }) {
  let in_trash = false;
  const reader = new StillsReader(() => show());
  const orders = new StillOrders({ commands, changed: () => reader.readAll() });
  const [found, empty] = [h("p", { class: "why found", role: "status" }), h("div", {})];
  const list = h("ul", { class: "cards" });
  const search = makeSearch({
    id: "still-search",
    placeholder: "Name, label or id",
    search: (text) => void reader.search(text),
    signal,
  });
  const showCards = changing(list, cardsOf(orders));
  const showEmpty = changing(empty, emptyOf);
  const trash = makeTrashDoor({
    noun: { one: "still", many: "stills" },
    trash: orders.trash,
    turn: (open) => {
      in_trash = open;
      search.hidden = open;
      show();
    },
  });
  const show = () => {
    const shown = in_trash ? reader.trash : reader.list;
    trash.show(in_trash, reader.trash?.length ?? 0);
    showCards(shown ?? []);
    say(found, shown && shown.length > 0 ? summary(shown) : "");
    const words =
      shown === null
        ? "Loading …"
        : shown.length > 0
          ? ""
          : in_trash
            ? "The trash is empty."
            : reader.searched
              ? `No still holds “${reader.searched}”.`
              : "none";
    showEmpty({ words, waiting: in_trash ? 0 : reader.waiting });
  };
  follow(reader);
  return h(
    "div",
    { class: "datasets stills" },
    h("div", { class: "gallery-bar" }, search, found, trash.element),
    empty,
    list,
  );
}

/**
 * Show cards of stills; those that did not change keep their elements and their pictures.
 * @param {StillOrders} orders
 */
function cardsOf(orders) {
  /** @type {Map<string, HTMLElement>} */
  let cards = new Map();
  return (/** @type {StillDocument[]} */ stills) => {
    const known = cards;
    cards = new Map(
      stills.map((still) => {
        const key = JSON.stringify(still);
        return [key, known.get(key) ?? stillCard(still, orders)];
      }),
    );
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
    waiting > 0 &&
      h(
        "p",
        { class: "strip warn" },
        icon("info"),
        h(
          "span",
          {},
          `${count(waiting)} ${waiting === 1 ? "still was" : "stills were"} taken and neither kept nor discarded. `,
          there,
          ".",
        ),
      ),
    words !== "" && nothing(words === "none" ? "No still yet." : words),
    words === "none" &&
      h(
        "p",
        { class: "lead" },
        "A still is a stack of pictures of every camera, taken where the mirrors stand. ",
        h("a", { href: "#/capture", text: "Take one" }),
        ".",
      ),
  ];
}
