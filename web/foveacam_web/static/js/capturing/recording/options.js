// How a recording is made: prefix of its numbered name, rate, compression, packing. Kept in this browser.

import { outcome, request } from "../../transport/api.js";
import { h, html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { momentName } from "../gallery/recording_words.js";
import { choiceField, tickField } from "../../elements/parts.js";
import { changeSettings } from "../../settings.js";

/**
 * @import { NameDocument, RecordingRequest } from "#api"
 * @import { Settings, Store } from "#console"
 */

const PAUSE_MS = 250;

/** Return the recording that the settings ask for. @param {Settings["record"]} record @param {Date} now @returns {RecordingRequest} */
export function recordingOf({ prefix, rate, compress, packed }, now) {
  const named = prefix.trim() === "" ? { name: momentName(now) } : { name: prefix.trim(), numbered: true };
  return { ...named, rate, compress, packed };
}

/** Build the fields. @param {{store: Store, signal: AbortSignal}} context */
export function recordOptions({ store, signal }) {
  const { record } = store.state.settings;
  const change = (/** @type {Partial<Settings["record"]>} */ part) =>
    changeSettings(store, { record: { ...store.state.settings.record, ...part } });
  const prefix = h("input", {
    type: "text",
    id: "record-prefix",
    maxlength: 90,
    value: record.prefix,
    placeholder: "date and time",
  });
  const next = h("p", { class: "why", role: "status" });
  const rate = choiceField(
    "Rate",
    [
      ["full", "as fast as the rig can"],
      ["live", "what the live views show"],
    ],
    (value) => change({ rate: value === "live" ? "live" : "full" }),
  );
  rate.put(record.rate);
  const compress = tickField("Compress each frame (zlib): it may not keep up at the full rate", record.compress);
  const packed = tickField("Pack twelve bits: two pixels in three bytes", record.packed);
  compress.input.addEventListener("change", () => change({ compress: compress.value() }));
  packed.input.addEventListener("change", () => change({ packed: packed.value() }));
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  const look = async () => {
    const { recording, settings } = store.state;
    const wish = recordingOf(settings.record, new Date());
    const query = new URLSearchParams({ name: wish.name, numbered: String(wish.numbered ?? false) });
    const asked = /** @type {Promise<NameDocument>} */ (request("GET", `/recordings/name?${query}`));
    const { answer } = await outcome(asked);
    if (signal.aborted || !answer) return; // the server is away, and the page says so
    const { free, name, why } = answer;
    prefix.classList.toggle("bad", !free);
    prefix.setAttribute("aria-invalid", String(!free));
    next.className = free ? "why" : "refused";
    const words = recording ? `The one after “${recording.name}”` : "The next one";
    update(next, free ? html`${words} is named “${name}”.` : html`${sentence(why)}`);
  };
  const wait = () => {
    clearTimeout(later);
    later = setTimeout(() => void look(), PAUSE_MS);
  };
  prefix.addEventListener("input", () => {
    change({ prefix: prefix.value });
    wait();
  });
  signal.addEventListener("abort", () => clearTimeout(later));
  store.on(["recording"], wait, signal);
  return html`<div class="record-options stack">
    <div class="field">
      <label for="record-prefix">Name, before its number</label><span class="entry">${prefix}</span>
    </div>
    ${next} ${rate.element}
    <div>${compress.element}</div>
    <div>${packed.element}</div>
    <p class="why">The round button at the top records, and R does on every page of the console.</p>
  </div>`;
}
