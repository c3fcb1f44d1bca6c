// The rig file: which one, what saving changes in it, undo, opening it, and the command that starts with it.

import { ask } from "../../elements/ask.js";
import { copyCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { fieldName, FIELDS } from "./values.js";
import { differenceLines, fieldId, lineCount, otherFaults } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { DraftDocument, RigFiles } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { SetupOrders } from "./orders.js"
 */

const NEW = "";
const SIMULATED = "simulated";

/** Build the choice of the rig file. @param {ConsoleState} state @param {SetupOrders} orders */
export function filesOf({ setup, setup_files, setup_begun_simulated }, orders) {
  if (!setup || !setup_files) return null;
  const { files } = setup_files;
  const listed = setup.file_exists && files.some(({ path }) => path === setup.path);
  // a new rig stays one when it takes simulated devices
  const chosen = listed ? setup.path : (setup_begun_simulated ?? setup.simulated) ? SIMULATED : NEW;
  const begin = async (/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget: select }) => {
    const simulated = select.value === SIMULATED;
    if (setup.changed && setup.file_exists && !(await ask(UNSAVED))) select.value = chosen;
    else void orders.begin(simulated ? null : select.value || null, simulated);
  };
  return html`<div class="field">
      <label for="setup-file">Rig file</label>
      <select id="setup-file" .value=${chosen} @change=${begin}>
        <option value=${SIMULATED} ?selected=${chosen === SIMULATED}>
          the simulated rig${setup_files.simulated ? ", open now" : ""}
        </option>
        <option value=${NEW} ?selected=${chosen === NEW}>a new rig</option>
        ${files.map(({ path, name, open }) => html`<option value=${path} ?selected=${chosen === path}>${name}${open ? ", open now" : ""}</option>`)}
      </select>
    </div>
    <p class="lead number">${setup.path}${setup.file_exists ? "" : " (not written yet)"}</p>`;
}

/** @param {ConsoleState} state @param {SetupOrders} orders */
export function reviewOf({ setup, setup_file, setup_files, stream }, orders) {
  if (!setup || !setup_file) return null;
  const why =
    setup.faults.length > 0
      ? "Correct these fields first:"
      : setup.changed
        ? ""
        : "The file contains all of this already.";
  return html`${otherFaults(setup, FIELDS).map(({ field, message }) => html`<p class="note bad"><b>${field}</b> ${sentence(message)}</p>`)}
    ${
      setup_file.meanwhile &&
      html`<p class="note warn" role="alert">The file was changed by somebody else meanwhile. Saving keeps these changes:</p>
        ${difference(setup_file.meanwhile, "Changed by others")}`
    }
    <div class="actions">
      ${textButton("Save", () => orders.save(), { kind: "plain primary", disabled: why !== "" || stream === "down" })}
      ${textButton("Undo the last saving", () => orders.undo(), {
        picture: "again",
        disabled: setup_file.versions === 0,
      })}
      <span class="why" role="status">${why}</span>
    </div>
    ${wrongFields(setup)}
    ${
      setup_file.changes &&
      html`<details class="details">
        <summary>What saving changes: ${lineCount(setup_file.changes)}</summary>
        ${difference(setup_file.changes, "What saving changes")}
      </details>`
    }
    ${setup_files && openOf(setup.path, setup_files, orders)} ${setup_files && scenesOf(setup_files, orders)}
    ${setup.file_exists && commandOf(setup_file.command)}`;
}

/** List the fields that keep the rig from being saved; each leads to its field. @param {DraftDocument} setup */
function wrongFields({ faults }) {
  const wrong = [...new Set(faults.map(({ field }) => field))].filter((field) => FIELDS.has(field));
  if (wrong.length === 0) return null;
  return html`<ul class="wrong-fields">
    ${wrong.map((field) => html`<li>${textButton(fieldName(field), () => leadTo(field), { picture: "target" })}</li>`)}
  </ul>`;
}

/** Show a field and put the focus into it. @param {string} field */
function leadTo(field) {
  const entry = document.getElementById(fieldId(field));
  entry?.scrollIntoView({ block: "center" });
  entry?.focus({ preventScroll: true });
}

/** @param {string} path @param {RigFiles} files @param {SetupOrders} orders */
function openOf(path, { files, simulated }, orders) {
  const entry = files.find((file) => file.path === path);
  const open = (/** @type {string | null} */ which) => async () => {
    if (await ask(OPENING)) void orders.open(which);
  };
  return html`<div class="actions">
    ${textButton(entry?.open ? "Open it again" : "Open this rig now", open(path), {
      kind: "plain primary",
      disabled: !entry || entry.problem !== null,
    })}
    ${!simulated && html`<button type="button" class="plain" data-rig=${SIMULATED} @click=${open(null)}>Open the simulated rig</button>`}
    <span class="why">${entry?.problem ? sentence(entry.problem) : entry?.open ? "This file's rig is open." : ""}</span>
  </div>`;
}

/** Build the choice of the simulated rig's scene, where that rig is open. @param {RigFiles} files @param {SetupOrders} orders */
function scenesOf({ simulated, scene, scenes }, orders) {
  if (!simulated) return null;
  const shipped = scenes.map(({ name, title }) => ({ value: name, text: `${name}: ${title}` }));
  const own = scene === null || scenes.some(({ name }) => name === scene) ? [] : [{ value: scene, text: scene }];
  const open = async (/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget: select }) => {
    const wanted = select.value;
    if (await ask({ ...OPENING, title: `Open the scene ${wanted}` })) await orders.open(null, wanted);
    else select.value = scene ?? "";
  };
  return html`<div class="field">
    <label for="setup-scene">Scene of the simulated rig</label>
    <select id="setup-scene" .value=${scene ?? ""} @change=${open}>
      ${[...own, ...shipped].map(({ value, text }) => html`<option value=${value} ?selected=${value === scene}>${text}</option>`)}
    </select>
  </div>`;
}

const OPENING = Object.freeze({
  title: "Open another rig",
  text: "The mirrors are parked, the rig that is open is closed, and this one is opened.",
  yes: "Open it",
});
const UNSAVED = Object.freeze({
  title: "Not saved",
  text: "Changes that are not saved are lost.",
  yes: "Give it up",
});

/** @param {string} command */
function commandOf(command) {
  return html`<div class="setup-command copied">
    <p class="lead">The server starts with it by:</p>
    <pre class="code scroll-x" tabindex="0" aria-label="Command">${command}</pre>
    <p class="actions">
      ${textButton("Copy", copyCode, { picture: "file" })}<span class="why" role="status"></span>
    </p>
  </div>`;
}

/** @param {string} text @param {string} label */
function difference(text, label) {
  return html`<pre class="difference scroll-x" tabindex="0" aria-label=${label}>${differenceLines(text).map(
    ({ tone, text: line }) => html`<span class=${tone}>${line}</span>`,
  )}</pre>`;
}
