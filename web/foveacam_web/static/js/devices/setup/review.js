// The rig file: which one, what saving changes in it, undo, opening it, and the command that starts with it.

import { ask } from "../../elements/ask.js";
import { copyCode } from "../../elements/copy.js";
import { html } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { FIELDS } from "./values.js";
import { differenceLines, otherFaults } from "./words.js";
import { textButton } from "../../elements/parts.js";

/**
 * @import { RigFileEntry } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { SetupOrders } from "./orders.js"
 */

const NEW = "";
const SIMULATED = "simulated";

/** Build the choice of the rig file. @param {ConsoleState} state @param {SetupOrders} orders */
export function filesOf({ setup, setup_files }, orders) {
  if (!setup || !setup_files) return null;
  const { files } = setup_files;
  const chosen = setup.file_exists && files.some(({ path }) => path === setup.path) ? setup.path : NEW;
  const begin = async (/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget: select }) => {
    const path = select.value || null;
    if (setup.changed && setup.file_exists && !(await ask(UNSAVED))) select.value = chosen;
    else void orders.begin(path);
  };
  return html`<div class="field">
      <label for="setup-file">Rig file</label>
      <select id="setup-file" .value=${chosen} @change=${begin}>
        <option value=${NEW} ?selected=${chosen === NEW}>a new rig</option>
        ${files.map(({ path, name }) => html`<option value=${path} ?selected=${chosen === path}>${name}</option>`)}
      </select>
    </div>
    <p class="lead number">${setup.path}${setup.file_exists ? "" : " (not written yet)"}</p>`;
}

/** @param {ConsoleState} state @param {SetupOrders} orders */
export function reviewOf({ setup, setup_file, setup_files, stream }, orders) {
  if (!setup || !setup_file) return null;
  const faults = setup.faults.length;
  const why =
    faults > 0
      ? `${faults} ${faults === 1 ? "field is" : "fields are"} to be corrected first.`
      : setup.changed
        ? ""
        : "The file contains all of this already.";
  return html`${otherFaults(setup, FIELDS).map(({ field, message }) => html`<p class="note bad"><b>${field}</b> ${sentence(message)}</p>`)}
    ${
      setup_file.meanwhile &&
      html`<p class="note warn" role="alert">The file was changed by somebody else meanwhile. Saving keeps these changes:</p>
        ${difference(setup_file.meanwhile, "Changed by others")}`
    }
    ${setup_file.changes ? difference(setup_file.changes, "What saving changes") : html`<p class="lead">Nothing to save.</p>`}
    <div class="actions">
      ${textButton("Save", () => orders.save(), { kind: "plain primary", disabled: why !== "" || stream === "down" })}
      ${textButton("Undo the last saving", () => orders.undo(), {
        picture: "again",
        disabled: setup_file.versions === 0,
      })}
      <span class="why" role="status">${why}</span>
    </div>
    ${openOf(setup.path, setup_files?.files ?? [], setup_files?.simulated ?? false, orders)}
    ${setup.file_exists && commandOf(setup_file.command)}`;
}

/** @param {string} path @param {RigFileEntry[]} files @param {boolean} simulated @param {SetupOrders} orders */
function openOf(path, files, simulated, orders) {
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
