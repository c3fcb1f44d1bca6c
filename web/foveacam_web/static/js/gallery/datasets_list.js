// Lists the datasets as cards, newest first, with a text search and the trash.

import { nothing } from "../calibration/parts.js";
import { changing, h, say } from "../dom.js";
import { count } from "../format.js";
import { makeCard } from "./dataset_card.js";
import { DatasetOrders } from "./dataset_orders.js";
import { sizeWords } from "./dataset_words.js";
import { readDatasets } from "./datasets_reader.js";
import { cardsIn, makeSearch, makeTrashDoor } from "./list_parts.js";

/**
 * @import { CaptureDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 */

/** @param {GalleryContext} context */
export function openList({ commands, follow, signal }) {
  let in_trash = false;
  const reader = readDatasets(() => show());
  const orders = new DatasetOrders({ commands, changed: () => reader.readAll() });
  const [found, empty] = [h("p", { class: "why found", role: "status" }), h("div", {})];
  const list = h("ul", { class: "cards" });
  const showCards = cardsIn(list, {
    key: (/** @type {CaptureDocument} */ { removed, id, folder }) => `${removed} ${id} ${folder}`,
    make: () => makeCard(orders),
  });
  const showEmpty = changing(empty, (/** @type {string} */ words) => (words === "" ? [] : emptyOf(words)));
  const search = makeSearch({
    id: "dataset-search",
    placeholder: "Name, label, id or state",
    search: (text) => void reader.search(text),
    signal,
  });
  const trash = makeTrashDoor({
    noun: { one: "dataset", many: "datasets" },
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
    showEmpty(
      shown === null
        ? "Loading …"
        : shown.length > 0
          ? ""
          : in_trash
            ? "The trash is empty."
            : reader.searched
              ? `No dataset holds “${reader.searched}”.`
              : "none",
    );
  };
  follow(reader);
  return h("div", { class: "datasets" }, h("div", { class: "gallery-bar" }, search, found, trash.element), empty, list);
}

/** @param {CaptureDocument[]} shown */
function summary(shown) {
  const bytes = shown.reduce((sum, { size_bytes }) => sum + size_bytes, 0);
  return [`${count(shown.length)} ${shown.length === 1 ? "dataset" : "datasets"}`, bytes > 0 && sizeWords(bytes)]
    .filter(Boolean)
    .join(", ");
}

/** @param {string} words */
function emptyOf(words) {
  if (words !== "none") return [nothing(words)];
  return [
    nothing("No dataset yet."),
    h(
      "p",
      { class: "lead" },
      "A raster that is captured shows up here from its first point on. ",
      h("a", { href: "#/capture", text: "Plan a capture" }),
      ".",
    ),
  ];
}
