// The record button of the top bar: a click starts a recording as the settings say, the next click ends it.

import { fill, h, html, setText } from "../../elements/dom.js";
import { count } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { boundWords, clockWords, droppedOf, tallyWords } from "../gallery/recording_words.js";
import { recordingOf } from "./options.js";

/** @param {{store: import("../../store.js").Store, live: import("./live.js").LiveRecording}} context */
export function makeRecordButton({ store, live }) {
  const words = h("span", { class: "words" });
  const button = h("button", { type: "button", class: "tool record" });
  const status = h("span", { class: "unseen", role: "status" });
  const place = h("span", { class: "record-place" }, button, status);
  let beginning = false;
  button.addEventListener("click", async () => {
    // The event that a recording has begun can come long before the response: the next press must end it even then.
    if (store.state.recording) return live.stop();
    if (beginning) return;
    beginning = true;
    try {
      await live.begin(recordingOf(store.state.settings.record, new Date()));
    } finally {
      beginning = false;
    }
  });
  let on = /** @type {boolean | null} */ (null);
  store.on(["recording"], ({ recording }) => {
    const now = recording !== null;
    if (on !== now) {
      if (on !== null) setText(status, now ? "Recording has begun" : "Recording has ended");
      on = now;
      button.classList.toggle("on", now);
      fill(button, icon(now ? "square" : "record"), now && words);
    }
    const name = now ? `Stop the recording “${recording.name}”` : "Record";
    button.setAttribute("aria-label", name);
    button.title = now
      ? `${name}: ${tallyWords(recording)}; ${boundWords(recording)}`
      : "Record what the cameras deliver (R), until it is stopped, for five minutes at most";
    button.disabled = recording?.state === "ending";
    if (recording)
      fill(
        words,
        html`<span class="number">${clockWords(recording.duration_s, 0)}</span>`,
        dropWords(droppedOf(recording)),
      );
  });
  return { element: place, press: () => button.click() };
}

/** @param {number} dropped */
function dropWords(dropped) {
  return html`<span class=${dropped > 0 ? "dropped some" : "dropped"}>${count(dropped)} dropped</span>`;
}
