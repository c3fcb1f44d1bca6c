// The page of all rigs of the lab: state, picture, driver and a link of each, read repeatedly while the page is open.

import { fill, h, html, update } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { badge } from "../../elements/parts.js";
import { pageHead } from "../../pages.js";
import { ROOT } from "../../root.js";
import { request } from "../../transport/api.js";
import { QuietReads } from "../../transport/quiet.js";
import { driverOf, kindOf, pictureOf, stateOf } from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { RigEntry } from "#api"
 * @import { Store } from "#console"
 */

const READ_MS = 3000;

/** @param {HTMLElement} place @param {{store: Store}} context */
export function mountRigsPage(place, { store }) {
  const [list, more] = [h("ul", { class: "rig-cards" }), h("p", { class: "note" })];
  const reads = new QuietReads();
  let [round, reading] = [0, false];
  const read = async () => {
    if (!store.state.rigs_page || document.hidden || reading) return;
    reading = true; // a rig that does not answer takes seconds
    await reads.read("rigs", async () => {
      const rigs = /** @type {RigEntry[]} */ (await request("GET", "/rigs"));
      round += 1;
      update(
        list,
        rigs.map((rig) => cardOf(rig, round)),
      );
      update(more, rigs.length === 1 ? alone() : "");
    });
    reading = false;
  };
  fill(place, pageHead("rigs-title", "All rigs"), list, more);
  update(list, waiting("Asking the rigs"));
  store.on(["rigs_page"], () => void read());
  document.addEventListener("visibilitychange", () => void read());
  setInterval(() => void read(), READ_MS);
}

/** @param {RigEntry} rig @param {number} round */
function cardOf(rig, round) {
  const [tone, state] = stateOf(rig);
  const own = rig.source === "this";
  const address = own ? `${ROOT}/#/` : rig.address;
  return html`<li class="panel rig-card" data-rig=${rig.id}>
    ${
      rig.state === null
        ? html`<div class="rig-picture none">No picture</div>`
        : html`<img class="rig-picture" src=${pictureOf(rig, round)} alt="Wide view of ${rig.name}" width="360" height="270" />`
    }
    <div class="rig-words">
      <h3>${rig.name} ${badge(tone, state)}</h3>
      <p class="note">${kindOf(rig)}</p>
      ${rig.problem !== null && html`<p class="state bad">${icon("warn")}${sentence(rig.problem)} ${sentence(rig.remedy ?? "")}</p>`}
      ${rig.problems.map((problem) => html`<p class="state warn">${icon("warn")}${problem}</p>`)}
      <p>${driverOf(rig)}</p>
      <a class="plain" href=${address} target=${own ? "_self" : "_blank"} rel="noopener">Open its console</a>
    </div>
  </li>`;
}

function alone() {
  return html`This is the only rig. Name others in a file (<code>foveacam serve --rigs FILE</code>), or let all announce
    themselves (<code>--announce</code>).`;
}
