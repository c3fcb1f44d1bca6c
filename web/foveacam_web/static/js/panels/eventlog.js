// Shows the events, newest first; repeated lines are counted.

import { fill, h, html } from "../elements/dom.js";
import { folded, MOST } from "../operating/event_log.js";
import { clockTime } from "../elements/format.js";
import { icon } from "../elements/icons.js";

/**
 * @import { EventDocument } from "#api"
 * @import { Store } from "#console"
 */

/** @param {HTMLElement} place @param {Store} store */
export function mountEventLog(place, store) {
  const list = h("ol", { class: "events", role: "log", "aria-label": "Events", tabindex: "0" });
  const only = h("input", { type: "checkbox", on: { change: () => show() } });
  const empty = h("p", { class: "empty", text: "Nothing has happened yet." });
  fill(place, html`<label class="only">${only} Warnings and errors only</label>`, empty, list);
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

/** @param {{event: EventDocument, times: number}} entry */
function line({ event, times }) {
  const bad = event.level === "error" || event.level === "warning";
  return html`<li class=${event.level}>
    <time datetime=${event.t_utc}>${clockTime(event.t_utc)}</time>
    ${bad ? icon("warn") : html`<span></span>`}
    <span class="message" title=${event.kind}>
      ${event.message}
      ${times > 1 && html`<span class="times"> ×${times}</span>`}
    </span>
  </li>`;
}
