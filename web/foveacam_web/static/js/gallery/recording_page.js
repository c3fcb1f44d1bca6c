// The page of one recording: state, player, contents, and buttons.

import { RequestError, request } from "../api.js";
import { badge, figures, nothing, panel } from "../calibration/parts.js";
import { changing, fill, h } from "../dom.js";
import { count, sentence } from "../format.js";
import { icon } from "../icons.js";
import { QuietReads } from "../quiet.js";
import { sizeWords, whenWords } from "./dataset_words.js";
import { makeEditable } from "./editable.js";
import { makePlayer } from "./player.js";
import { makeDepth } from "./player_depth.js";
import { makeFilm } from "./player_film.js";
import { RecordingOrders } from "./recording_orders.js";
import {
  CAMERAS,
  clockWords,
  isBeingMade,
  lossWords,
  rateWords,
  recordingPath,
  sizeOf,
  stateWords,
} from "./recording_words.js";
import { galleryAddress } from "./route.js";

/**
 * @import { RecordingDocument, TimelineDocument } from "#api"
 * @import { GalleryContext } from "./tabs.js"
 */

const COLUMNS = [
  ["Camera"],
  ["Frames"],
  ["Dropped", "They came, and are not on the file"],
  ["Missing", "Between the frames that came these numbers are missing: nobody read them, or they never came"],
  ["Rate"],
];

/**
 * @param {string} id
 * @param {GalleryContext} context
 */
export function openRecording(id, context) {
  const { store, follow, signal } = context;
  const reads = new QuietReads();
  const place = h("div", { class: "dataset" }, nothing("Loading …"));
  const readAll = () =>
    reads.read("recording", async () => {
      try {
        show(await request("GET", recordingPath(id)));
      } catch (error) {
        if (!(error instanceof RequestError) || error.slug !== "not-found") throw error;
        fill(
          place,
          nothing(sentence(error.message)),
          h(
            "p",
            { class: "lead" },
            "It may be in the trash. ",
            h("a", { href: galleryAddress("recordings"), text: "To the recordings" }),
            ".",
          ),
        );
      }
    });
  const orders = new RecordingOrders({ ...context, changed: readAll });
  const page = makePage(id, orders, context);
  const show = (/** @type {RecordingDocument} */ recording) => {
    if (place.firstChild !== page.element) fill(place, page.element);
    page.show(recording);
  };
  store.on(["recording"], ({ recording }) => recording?.id === id && show(recording), signal);
  follow({
    readAll,
    hear: ({ kind, data }) => void (kind.startsWith("recording.") && data?.["recording_id"] === id && readAll()),
  });
  return place;
}

/**
 * @param {string} id
 * @param {RecordingOrders} orders
 * @param {GalleryContext} context
 */
function makePage(id, orders, context) {
  const [name, actions, far, cameras, facts] = [
    h("div", { class: "name" }),
    h("div", { class: "actions" }),
    h("div", { class: "far" }),
    h("div", { class: "stack" }),
    h("div", { class: "stack" }),
  ];
  const label = makeEditable("Label", { save: (value) => orders.describe(id, value), hint: "What is to be seen" });
  const showName = changing(name, nameOf);
  const showActions = changing(actions, (/** @type {RecordingDocument} */ recording) => actionsOf(recording, orders));
  const showFar = changing(far, farOf);
  const showCameras = changing(cameras, camerasOf);
  const showFacts = changing(facts, factsOf);
  const stage = makeStage(id, orders, context);
  const element = h(
    "article",
    { class: "dataset-page recording-page" },
    h("header", { class: "dataset-head" }, name, actions, far),
    h(
      "div",
      { class: "dataset-body" },
      stage.element,
      h("div", { class: "column" }, stage.beside, panel("Cameras", cameras), panel("About", label.element, facts)),
    ),
  );
  return {
    element,
    show: (/** @type {RecordingDocument} */ recording) => {
      const settled = { ...recording, streams: [], duration_s: 0, size_bytes: 0, label: "" };
      showName(settled);
      showActions(settled);
      showFar(settled);
      showCameras(recording.streams);
      showFacts({ ...recording, streams: [], label: "", why: "" });
      label.show(recording.label);
      stage.show(recording);
    },
  };
}

/**
 * Show the player as soon as the recording can be played, with depth and film beside it.
 * @param {string} id
 * @param {RecordingOrders} orders
 * @param {GalleryContext} context
 */
function makeStage(id, orders, { store, signal }) {
  const [element, beside] = [h("div", { class: "column" }), h("div", { class: "column" })];
  let shown = "";
  const begin = async (/** @type {RecordingDocument} */ recording) => {
    try {
      const timeline = /** @type {TimelineDocument} */ (
        await request("GET", recordingPath(id, "/timeline"), { patience_ms: 60_000 })
      );
      if (signal.aborted) return;
      const depth = makeDepth(id, { orders, at: () => player.at() });
      const player = makePlayer(id, timeline, {
        store,
        signal,
        moved: (at_s) => depth.move(at_s),
        depth: () => void depth.compute(),
      });
      fill(element, player.element);
      fill(beside, panel("Depth", depth.element), panel("Film", makeFilm(recording, { orders, signal })));
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      fill(element, nothing(sentence(error.message)));
    }
  };
  return {
    element,
    beside,
    show: (/** @type {RecordingDocument} */ recording) => {
      const now = isBeingMade(recording) ? "made" : recording.playable ? "play" : "empty";
      if (now === shown) return;
      shown = now;
      if (now === "play") void begin(recording);
      else
        fill(
          element,
          nothing(
            now === "made"
              ? "It is being made. It can be played once it has ended."
              : recording.state === "damaged"
                ? "It cannot be played, as it cannot be read. Its file was left alone."
                : "There is no frame in it.",
          ),
        );
    },
  };
}

/** @param {RecordingDocument} recording */
function nameOf(recording) {
  const word = stateWords(recording);
  return [
    h(
      "a",
      {
        class: "tool",
        href: galleryAddress("recordings"),
        "aria-label": "Back to the recordings",
        title: "Back to the recordings",
      },
      icon("back"),
    ),
    h("h3", { text: recording.name, tabindex: "-1" }),
    badge(word.tone, word.text),
  ];
}

/**
 * @param {RecordingDocument} recording
 * @param {RecordingOrders} orders
 */
function actionsOf(recording, orders) {
  const live = isBeingMade(recording);
  const remove = async () => {
    if (await orders.trash.remove(recording)) location.hash = galleryAddress("recordings");
  };
  return [
    !live &&
      recording.state !== "damaged" &&
      h(
        "a",
        { class: "plain", href: `${recording.url}/download.fcap`, download: recording.file },
        icon("down"),
        "Download the file",
      ),
    h(
      "button",
      {
        type: "button",
        class: "plain",
        data: { keep: "remove" },
        disabled: live,
        title: live ? "Not while it is being made" : "It can be restored until the trash is emptied",
        on: { click: () => void remove() },
      },
      icon("trash"),
      "Put in the trash",
    ),
  ];
}

/** @param {RecordingDocument} recording */
function farOf({ why, state, truncated }) {
  if (why === "") return [];
  const rest = truncated ? " What comes before was found by reading the file through, and is whole." : "";
  return [h("p", { class: state === "damaged" ? "strip bad" : "strip warn" }, icon("warn"), `${sentence(why)}${rest}`)];
}

/** @param {number | null} counted */
function countedWords(counted) {
  return counted === null ? "not counted" : count(counted);
}

/** @param {RecordingDocument["streams"]} streams */
function camerasOf(streams) {
  if (streams.length === 0) return [nothing("No camera in it.")];
  return [
    h(
      "table",
      { class: "tally" },
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          COLUMNS.map(([text, title]) => h("th", { scope: "col", text, title })),
        ),
      ),
      h(
        "tbody",
        {},
        streams.map((stream) =>
          h(
            "tr",
            {},
            h("th", {
              scope: "row",
              class: `role-${stream.role}`,
              text: stream.role === null ? stream.name : CAMERAS[stream.role],
              title: sizeOf(stream),
            }),
            h("td", { text: count(stream.frames) }),
            h("td", { class: (stream.dropped ?? 0) > 0 ? "warn-text" : "", text: countedWords(stream.dropped) }),
            h("td", { text: countedWords(stream.missing) }),
            h("td", { text: rateWords(stream.fps) }),
          ),
        ),
      ),
    ),
    ...streams
      .filter((stream) => lossWords(stream) !== "")
      .map((stream) => h("p", { class: "why", text: `${stream.name}: dropped ${lossWords(stream)}` })),
  ];
}

/** @param {RecordingDocument} recording */
function factsOf(recording) {
  return [
    figures([
      ["Length", clockWords(recording.duration_s, 1)],
      ["Size", sizeWords(recording.size_bytes)],
      ["Recorded", whenWords(recording.created_utc)],
      ["Rig", recording.rig_id],
      ["Calibration", recording.calibration_id ?? recording.calibration_problem ?? "none in it"],
      ["File", recording.file],
    ]),
  ];
}
