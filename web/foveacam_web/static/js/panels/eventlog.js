// Shows the events, newest first; repeated lines are counted.

import { fill, h } from "../dom.js";
import { clockTime } from "../format.js";
import { icon } from "../icons.js";

/**
 * @import { EventDocument } from "#api"
 * @import { Store } from "../store.js"
 */

const MOST = 200;
const NOISE = new Set([
  "fixation.step",
  "mirrors.steered",
  "job.updated",
  "calibration.progress",
  "calibration.sample",
  "calibration.pose",
]); // shown elsewhere on the page

/**
 * @param {HTMLElement} place
 * @param {Store} store
 */
export function mountEventLog(place, store) {
  const list = h("ol", { class: "events", role: "log", "aria-label": "Events", tabindex: "0" });
  const only = h("input", { type: "checkbox", on: { change: () => show() } });
  const empty = h("p", { class: "empty", text: "Nothing has happened yet." });
  fill(place, h("label", { class: "only" }, only, " Warnings and errors only"), empty, list);
  const show = () => {
    const { log } = store.state;
    const wanted = log.filter(({ level }) => !only.checked || level === "warning" || level === "error");
    const lines = folded(wanted.slice(-MOST)).reverse();
    empty.hidden = lines.length > 0;
    fill(list, ...lines.map(line));
  };
  store.on(["log"], () => place.hidden || show());
  return { show };
}

/**
 * Return the log with an event added; the newest 200 are kept.
 * @param {EventDocument[]} log
 * @param {EventDocument} event
 * @returns {EventDocument[]}
 */
export function withEvent(log, event) {
  if (NOISE.has(event.kind) || log.some(({ id }) => id === event.id)) return log;
  return [...log.slice(1 - MOST), event];
}

/**
 * Merge consecutive equal events into one line with a count.
 * @param {EventDocument[]} log
 */
function folded(log) {
  /** @type {{event: EventDocument, times: number}[]} */
  const lines = [];
  for (const event of log) {
    const last = lines.at(-1);
    if (last && last.event.kind === event.kind && last.event.message === event.message) {
      last.times += 1;
      last.event = event;
    } else lines.push({ event, times: 1 });
  }
  return lines;
}

/** @param {{event: EventDocument, times: number}} entry */
function line({ event, times }) {
  const bad = event.level === "error" || event.level === "warning";
  return h(
    "li",
    { class: event.level },
    h("time", { datetime: event.t_utc, text: clockTime(event.t_utc) }),
    bad ? icon("warn") : h("span", {}),
    h(
      "span",
      { class: "message", title: event.kind },
      event.message,
      times > 1 && h("span", { class: "times", text: ` ×${times}` }),
    ),
  );
}
