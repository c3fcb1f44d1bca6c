// The dialog that starts a complete calibration: its steps, its label, and whether the result is put in use.

import { h, html, setText, update } from "../../elements/dom.js";
import { sheet } from "../../panels/dialogs.js";
import { starter, tickField } from "../../elements/parts.js";
import { hasNoMarkers } from "../acceptance/words.js";
import { missingStations } from "../missing_stations.js";

/**
 * @import { SessionDocument } from "#api"
 * @import { WizardContext } from "./page.js"
 */

const WHY = "Without markers neither the mirrors nor their settle times can be measured.";

/** @param {WizardContext} context @returns {() => void} opens the dialog */
export function makeEverything({ store, orders }) {
  const label = h("input", {
    type: "text",
    id: "all-label",
    maxlength: 80,
    placeholder: "date and time",
    autocomplete: "off",
  });
  const named = h("div", { class: "setting" }, html`<label for="all-label">Label</label>`, label);
  const start = choiceOfStart(() => (named.hidden = !start.fresh()));
  const activate = tickField("Take the result into use", true);
  const turn = h("p", { class: "remedy" });
  const missing = h("div", {});
  const act = async () => {
    dialog.close();
    if (start.fresh() && !(await orders.newSession(label.value.trim()))) return;
    await orders.run("all", { activate: activate.value() });
  };
  const button = starter({
    label: "Start",
    store,
    act,
    primary: true,
    keys: ["pan_tilt"],
    why: ({ pan_tilt }) =>
      pan_tilt && !pan_tilt.present
        ? "This rig has no pan-tilt, and none by hand is set up."
        : hasNoMarkers(pan_tilt)
          ? "This rig has no station with markers."
          : null,
  });
  const dialog = sheet(
    "Calibrate everything",
    plan(),
    missing,
    turn,
    start.element,
    named,
    activate.element,
    h("p", { class: "actions" }, button),
  );
  store.on(["pan_tilt"], ({ pan_tilt }) =>
    setText(
      turn,
      !pan_tilt?.present || hasNoMarkers(pan_tilt)
        ? ""
        : pan_tilt.moves_itself
          ? "The rig and its mirrors will move: keep clear. It takes five to ten minutes. STOP and Cancel work at any time, and what was measured is kept."
          : "You turn the rig by hand as the wizard instructs. Cancel works at any time, and what was measured is kept.",
    ),
  );
  store.on(["pan_tilt", "rig"], ({ pan_tilt, rig }) =>
    update(
      missing,
      hasNoMarkers(pan_tilt) && missingStations({ simulated: rig?.simulated ?? false, why: WHY }, orders),
    ),
  );
  /** @type {string | null} */
  let offered = null;
  const offer = (/** @type {SessionDocument | null} */ session) => {
    offered = session?.id ?? null;
    start.offer(session);
  };
  // the dialog may open before the sessions have been read
  store.on(["session"], ({ session }) => dialog.open && (session?.id ?? null) !== offered && offer(session));
  return () => {
    offer(store.state.session);
    dialog.showModal();
  };
}

function plan() {
  return html`<ol class="plan">
    <li><b>Wide camera. </b>A helper shows the board at its station.</li>
    <li><b>Mirrors. </b>The rig turns to each station with markers; both eyes centre theirs at every node.</li>
    <li><b>Rectify. </b>The models are fitted and chosen by cross-validation.</li>
    <li><b>Check. </b>The result is validated at positions that were not measured.</li>
    <li><b>Settle times. </b>How fast the mirrors settle after a step.</li>
  </ol>`;
}

/**
 * Build the choice between the open session and a new one; an unfinished session is continued by default.
 * @param {() => void} changed
 */
function choiceOfStart(changed) {
  const radio = (/** @type {string} */ id) =>
    h("input", { type: "radio", name: "all-start", id, on: { change: changed } });
  const [on, anew] = [radio("all-on"), radio("all-anew")];
  const words = h("span", {});
  const element = h(
    "div",
    { class: "starts", role: "radiogroup", "aria-label": "Where to begin" },
    html`<label class="field tick">${on}${words}</label>`,
    html`<label class="field tick">
      ${anew}
      <span>Measure everything again; existing measurements stay</span>
    </label>`,
  );
  return {
    element,
    fresh: () => anew.checked,
    offer: (/** @type {SessionDocument | null} */ session) => {
      element.hidden = session === null;
      on.checked = session !== null && session.fit === null;
      anew.checked = !on.checked;
      setText(words, session ? `Go on with “${session.label || session.id}”: ${heldBy(session)}` : "");
      changed();
    },
  };
}

/** @param {SessionDocument} session */
function heldBy({ wide, sweeps, fit }) {
  const views = wide?.samples.length ?? 0;
  const [done, nodes] = [sum(sweeps.map((sweep) => sweep.done)), sum(sweeps.map((sweep) => sweep.nodes))];
  const held = [
    views ? `${views} views of the board` : "",
    nodes ? `${done} of ${nodes} nodes` : "",
    fit ? "fitted" : "",
  ].filter(Boolean);
  return held.length ? held.join(", ") : "still empty";
}

/** @param {number[]} counts */
function sum(counts) {
  return counts.reduce((total, count) => total + count, 0);
}
