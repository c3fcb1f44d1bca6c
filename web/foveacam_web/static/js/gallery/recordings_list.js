// Lists the recordings as cards, newest first, with a text search and the trash; shows the counts of a running one.

import { badge, nothing } from "../calibration/parts.js";
import { changing, fill, h, say } from "../dom.js";
import { count, sentence } from "../format.js";
import { icon } from "../icons.js";
import { sizeWords, whenWords } from "./dataset_words.js";
import { makeDrawn } from "./drawn.js";
import { KeptReader } from "./kept_reader.js";
import { cardsIn, makeSearch, makeTrashDoor } from "./list_parts.js";
import { RecordingOrders } from "./recording_orders.js";
import { boundWords, clockWords, isBeingMade, stateWords, tallyWords } from "./recording_words.js";
import { galleryAddress } from "./route.js";

/**
 * @import { RecordingDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 * @typedef {{element: HTMLElement, show: (recording: RecordingDocument) => void}} Card
 */

const WIDTH_PX = 320;
const HEIGHT_PX = 240;

/** @param {GalleryContext} context */
export function openRecordingList({ store, commands, follow, signal }) {
  let in_trash = false;
  /** @type {KeptReader<RecordingDocument>} */
  const reader = new KeptReader({
    resource: "/recordings",
    changed: () => show(),
    hear: (list, { kind }) => void (kind.startsWith("recording.") && list.readAll()),
  });
  const orders = new RecordingOrders({ commands, changed: () => reader.readAll() });
  const [found, empty] = [h("p", { class: "why found", role: "status" }), h("div", {})];
  const list = h("ul", { class: "cards" });
  const showCards = cardsIn(list, {
    key: (/** @type {RecordingDocument} */ { removed, id }) => `${removed} ${id}`,
    make: () => makeCard(orders),
  });
  const showEmpty = changing(empty, (/** @type {string} */ words) => (words === "" ? [] : emptyOf(words)));
  const search = makeSearch({
    id: "recording-search",
    placeholder: "Name, label, id or state",
    search: (text) => void reader.search(text),
    signal,
  });
  const trash = makeTrashDoor({
    noun: { one: "recording", many: "recordings" },
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
              ? `No recording holds “${reader.searched}”.`
              : "none",
    );
  };
  follow(reader);
  store.on(["recording"], ({ recording }) => recording && reader.change(recording.id, () => recording), signal);
  return h("div", { class: "datasets" }, h("div", { class: "gallery-bar" }, search, found, trash.element), empty, list);
}

/** @param {RecordingDocument[]} shown */
function summary(shown) {
  const bytes = shown.reduce((sum, { size_bytes }) => sum + size_bytes, 0);
  return [`${count(shown.length)} ${shown.length === 1 ? "recording" : "recordings"}`, sizeWords(bytes)].join(", ");
}

/** @param {string} words */
function emptyOf(words) {
  if (words !== "none") return [nothing(words)];
  return [
    nothing("No recording yet."),
    h("p", {
      class: "lead",
      text: "The round button in the bar at the top records what all three cameras deliver, while you go on working.",
    }),
  ];
}

/**
 * @param {RecordingOrders} orders
 * @returns {Card}
 */
function makeCard(orders) {
  const drawn = makeDrawn({ lazy: true, width: WIDTH_PX, height: HEIGHT_PX });
  const blank = h("p", { class: "blank" });
  const [cover, name, words, tools] = [
    h("div", { class: "card-cover" }),
    h("h3", {}),
    h("div", { class: "words" }),
    h("div", { class: "tools" }),
  ];
  const showName = changing(name, (/** @type {RecordingDocument} */ recording) => nameOf(recording));
  const showWords = changing(words, wordsOf);
  const showTools = changing(tools, (/** @type {{id: string, name: string, removed: boolean, live: boolean}} */ now) =>
    toolsOf(now, orders),
  );
  return {
    element: h("li", { class: "card" }, cover, name, words, tools),
    show: (recording) => {
      const { id, name: called, removed } = recording;
      const why = removed
        ? "In the trash"
        : isBeingMade(recording)
          ? "Being recorded"
          : recording.playable
            ? ""
            : recording.state === "damaged"
              ? "No picture: it cannot be read"
              : "No frame in it";
      if (why === "") drawn.show(coverUrl(recording), "");
      say(blank, why);
      const shown = why === "" ? drawn.element : blank;
      if (cover.firstChild !== shown) fill(cover, shown);
      showName({ ...recording, streams: [], duration_s: 0, size_bytes: 0, state: "complete", why: "" });
      showWords(recording);
      showTools({ id, name: called, removed, live: isBeingMade(recording) });
    },
  };
}

/** @param {RecordingDocument} recording */
export function coverUrl({ url, streams }) {
  const shown =
    streams.find(({ role, frames }) => role === "wide" && frames > 0) ??
    streams.find(({ role, frames }) => role !== null && frames > 0);
  return `${url}/frames/${shown?.role ?? "wide"}/${Math.floor((shown?.frames ?? 0) / 2)}.jpg?scale=2`;
}

/** @param {RecordingDocument} recording */
function nameOf({ id, name, removed, playable }) {
  if (removed) return [h("span", { text: name, title: name })];
  return [
    h("a", {
      href: galleryAddress("recordings", id),
      title: name,
      text: name,
      data: { keep: "name", playable: String(playable) },
    }),
  ];
}

/** @param {RecordingDocument} recording */
function wordsOf(recording) {
  const { text, tone } = stateWords(recording);
  return [
    recording.label !== "" && h("p", { class: "label", text: recording.label }),
    h(
      "p",
      { class: "facts" },
      badge(tone, text),
      h("span", { class: "number", text: clockWords(recording.duration_s, 1) }),
      h("span", { class: "tally-words", text: tallyWords(recording) }),
    ),
    isBeingMade(recording) && h("p", { class: "bound", text: sentence(boundWords(recording)) }),
    recording.why !== "" && h("p", { class: "reason", text: sentence(recording.why) }),
    h(
      "p",
      { class: "when" },
      recording.created_utc !== null &&
        h("time", { datetime: recording.created_utc, text: whenWords(recording.created_utc) }),
    ),
  ];
}

/**
 * @param {{id: string, name: string, removed: boolean, live: boolean}} now
 * @param {RecordingOrders} orders
 */
function toolsOf(now, orders) {
  if (now.removed)
    return [
      h(
        "button",
        {
          type: "button",
          class: "plain",
          data: { keep: "tool" },
          "aria-label": `Restore ${now.name}`,
          on: { click: () => void orders.trash.restore(now) },
        },
        icon("again"),
        "Restore",
      ),
    ];
  return [
    h(
      "button",
      {
        type: "button",
        class: "tool",
        data: { keep: "tool" },
        "aria-label": `Put ${now.name} in the trash`,
        title: now.live ? "Not while it is being made" : "Put it in the trash",
        disabled: now.live,
        on: { click: () => void orders.trash.remove(now) },
      },
      icon("trash"),
    ),
  ];
}
