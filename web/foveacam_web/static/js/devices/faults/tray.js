// The button of the top bar that counts faults and warnings, and the tray that lists them.

import { fill, h, html, repeat, update } from "../../elements/dom.js";
import { clockTime, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { sheet } from "../../panels/dialogs.js";
import { badge, nothing, textButton, toolButton } from "../../elements/parts.js";
import { placeWords, trayLabel, trayRows, trayTone, whenWords } from "./words.js";

/**
 * @import { FaultDocument } from "#api"
 * @import { Store } from "#console"
 * @import { FaultReader } from "./reader.js"
 */

/**
 * Build the button with its tray.
 * @param {HTMLElement} place
 * @param {{store: Store, reader: FaultReader}} context
 * @returns {{open: () => void}}
 */
export function mountFaultTray(place, { store, reader }) {
  const list = h("div", { class: "fault-rows" });
  const dialog = sheet("Faults and warnings", list);
  dialog.classList.add("fault-tray");
  const button = h("button", { type: "button", "aria-haspopup": "dialog", on: { click: () => dialog.showModal() } });
  fill(place, button);
  store.on(["server_faults", "page_faults"], ({ server_faults, page_faults }) => {
    const rows = trayRows(server_faults, page_faults);
    button.className = `tool fault-button ${trayTone(rows)}`;
    button.title = trayLabel(rows);
    button.setAttribute("aria-label", button.title);
    fill(button, icon("warn"), rows.length > 0 && html`<span class="number">${rows.length}</span>`);
    update(list, trayContent(rows, reader));
  });
  return { open: () => dialog.showModal() };
}

/** @param {FaultDocument[]} rows @param {FaultReader} reader */
function trayContent(rows, reader) {
  if (rows.length === 0) return nothing("No faults and no warnings.");
  const over = rows.some(({ present }) => !present);
  return html`
    <ul aria-label="Faults and warnings">
      ${repeat(
        rows,
        ({ id }) => id,
        (row) => faultRow(row, reader),
      )}
    </ul>
    ${
      over &&
      html`<p class="buttons">
        ${textButton("Dismiss all that are over", () => reader.dismissOver())}
      </p>`
    }
  `;
}

/** @param {FaultDocument} row @param {FaultReader} reader */
function faultRow(row, reader) {
  const tone = row.level === "error" ? "bad" : "warn";
  const place = placeWords(row);
  return html`<li class="fault ${tone} ${row.present ? "present" : "over"}">
    ${icon("warn")}
    <div class="body">
      <p class="heading">
        <b>${place}</b>
        <span class="unseen">${row.level}</span>
        ${row.present ? badge(tone, "present") : badge("plain", "over")}
      </p>
      <p>${sentence(row.what)}</p>
      ${row.remedy && !row.what.includes(row.remedy) && html`<p class="remedy">${sentence(row.remedy)}</p>`}
      <p class="when">${whenWords(row, clockTime)}</p>
    </div>
    ${toolButton(`Dismiss: ${place}`, "close", () => reader.dismiss(row), { title: "Dismiss" })}
  </li>`;
}
