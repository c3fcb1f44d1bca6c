// Small parts of the pages: panels, fields, figures, and buttons that show why they are disabled.

import { absent, fill, h, html, setText } from "./dom.js";
import { MISSING } from "./format.js";
import { icon } from "./icons.js";
import { isRunning } from "../calibrating/calibration/state.js";

/**
 * @import { JobDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { Child } from "./dom.js"
 * @import { IconName } from "./icons.js"
 * @typedef {{element: HTMLElement, input: HTMLInputElement, value: () => number | null, put: (value: number | null) => void}} NumberField
 */

/** Build a panel with its title. @param {string} title @param {...(Child | Child[])} children */
export function panel(title, ...children) {
  return html`<section class="panel" aria-label=${title}>
    <header><h3>${title}</h3></header>
    <div class="inside">${children}</div>
  </section>`;
}

/**
 * Build a button that starts something. While it cannot, it is disabled and the reason is shown beside it.
 * @param {{
 *   label: string, store: Store, act: () => unknown, primary?: boolean, picture?: IconName,
 *   keys?: (keyof ConsoleState)[], why?: (state: ConsoleState) => string | null, named?: (state: ConsoleState) => string, silent?: boolean
 * }} options `why`: the reason why it is disabled now, else null; `silent`: the button beside it shows the reason already
 */
export function starter({
  label,
  store,
  act,
  primary = false,
  picture,
  keys = [],
  why = () => null,
  named,
  silent = false,
}) {
  const words = h("span", { text: label });
  const reason = h("span", { class: "why", role: "status" });
  const button = h(
    "button",
    { type: "button", class: primary ? "plain primary" : "plain", on: { click: () => void act() } },
    picture && icon(picture),
    words,
  );
  store.on(["work", "stream", ...keys], (state) => {
    const against =
      state.stream === "down"
        ? "No connection to the server."
        : (why(state) ?? (isRunning(state.work) ? "Something runs already." : null));
    button.disabled = against !== null;
    setText(reason, against !== null && !silent && !isRunning(state.work) ? against : "");
    if (named) setText(words, named(state));
  });
  return html`<span class="starter">${button}${reason}</span>`;
}

/**
 * Build a button that shows only a picture.
 * @param {string} label
 * @param {IconName} picture
 * @param {(event: any) => unknown} act `any`: a click, whose target is the button
 * @param {{title?: string, pressed?: boolean, disabled?: boolean}} [options] `title`: where it says more than the label;
 *   `pressed`: for a button that switches something
 */
export function toolButton(label, picture, act, { title = label, pressed, disabled = false } = {}) {
  return html`<button
    type="button" class="tool" aria-label=${label} title=${title} ?disabled=${disabled}
    aria-pressed=${stated(pressed)} @click=${act}
  >
    ${icon(picture)}
  </button>`;
}

/**
 * Build a button with a text.
 * @param {string} text
 * @param {(event: any) => unknown} act `any`: a click, whose target is the button
 * @param {{
 *   kind?: string, picture?: IconName, name?: string, title?: string, disabled?: boolean, hidden?: boolean,
 *   pressed?: boolean, expanded?: boolean
 * }} [options] `name`: for screen readers, where the text alone does not say what it acts on
 */
export function textButton(text, act, options = {}) {
  const { kind = "plain", picture, name, title, disabled = false, hidden = false, pressed, expanded } = options;
  return html`<button
    type="button" class=${kind} aria-label=${name ?? absent} title=${title ?? absent} ?disabled=${disabled}
    ?hidden=${hidden} aria-pressed=${stated(pressed)} aria-expanded=${stated(expanded)} @click=${act}
  >
    ${picture && icon(picture)}${text}
  </button>`;
}

/** Build a button with a text that its module keeps and changes. @param {Parameters<typeof textButton>} button */
export function keptButton(...button) {
  const place = h("div", {}, textButton(...button));
  return /** @type {HTMLButtonElement} */ (place.firstElementChild);
}

/** Return the value of an attribute that is not there where nothing is to be stated. @param {boolean | undefined} on */
function stated(on) {
  return on === undefined ? absent : String(on);
}

let fields = 0;

/**
 * Build a number field; where empty is allowed, it means that the rig decides.
 * @param {string} label
 * @param {{value?: number | null, min?: number, max?: number, step?: number | "any", unit?: string, hint?: string}} [options]
 * @returns {NumberField}
 */
export function numberField(label, { value = null, min, max, step = 1, unit = "", hint = "" } = {}) {
  fields += 1;
  const id = `field-${fields}`;
  const input = h("input", {
    type: "number",
    id,
    value: value ?? "",
    min,
    max,
    step,
    placeholder: hint,
    inputmode: "decimal",
  });
  const element = h(
    "div",
    { class: "field" },
    html`<label for=${id}>${label}</label>`,
    html`<span class="entry">${input}${unit && html`<span class="unit">${unit}</span>`}</span>`,
  );
  const put = (/** @type {number | null} */ given) => {
    input.value = given === null ? "" : String(given);
  };
  return { element, input, value: () => (Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : null), put };
}

/**
 * @param {string} label
 * @param {[string, string][]} choices value and text
 * @param {(value: string) => void} [changed]
 */
export function choiceField(label, choices, changed = () => {}) {
  fields += 1;
  const id = `field-${fields}`;
  const input = h(
    "select",
    { id, on: { change: () => changed(input.value) } },
    choices.map(([value, text]) => html`<option value=${value}>${text}</option>`),
  );
  const put = (/** @type {string} */ value) => {
    input.value = value;
  };
  return {
    element: h("div", { class: "field" }, html`<label for=${id}>${label}</label>`, input),
    input,
    value: () => input.value,
    put,
  };
}

/** @param {string} label @param {boolean} checked */
export function tickField(label, checked) {
  const input = h("input", { type: "checkbox", checked });
  const put = (/** @type {boolean} */ on) => {
    input.checked = on;
  };
  return {
    element: h("label", { class: "field tick" }, input, html`<span>${label}</span>`),
    input,
    value: () => input.checked,
    put,
  };
}

/** Return whether all fields are valid; the browser shows the first that is not. @param {...NumberField} entries */
export function allHold(...entries) {
  return entries.every(({ input }) => input.closest("[hidden]") !== null || input.reportValidity());
}

/** Build a list of names and values in two columns. @param {[string, Child][]} rows */
export function figures(rows) {
  return html`<dl class="numbers">
    ${rows.flatMap(([name, value]) => [
      html`<dt>${name}</dt>`,
      html`<dd class="number">${value === "" || value === null || value === undefined ? MISSING : value}</dd>`,
    ])}
  </dl>`;
}

/** Build the text of an empty list. @param {string} text */
export function nothing(text) {
  return html`<p class="empty">${text}</p>`;
}

/**
 * Build a badge with a tone: good, warn, bad or plain.
 * @param {string} tone
 * @param {string} text
 * @param {string} [title]
 */
export function badge(tone, text, title) {
  return html`<span class="badge ${tone}" title=${title ?? absent}>${text}</span>`;
}

/**
 * Build a progress bar that screen readers can read.
 * @param {string} label
 * @param {{share: number | null, text: string}} how `share` in 0 … 1, null while it is unknown
 */
export function bar(label, { share, text }) {
  const value = share === null ? undefined : Math.round(Math.min(1, Math.max(0, share)) * 100);
  return html`<div
    class=${share === null ? "bar endless" : "bar"} role="progressbar" aria-label=${label} aria-valuemin="0"
    aria-valuemax="100" aria-valuenow=${value ?? absent} aria-valuetext=${text}
  >
    <span class="part" .style=${`inline-size: ${value ?? 0}%`}></span>
  </div>`;
}

/**
 * Return the finished share of a job; null while it is unknown.
 * @param {{done: number, total: number | null} | null | undefined} progress
 */
export function shareOf(progress) {
  return progress?.total && progress.done > 0 ? progress.done / progress.total : null;
}

/**
 * Build the row of a running job: what it does, how far it is, and the button that cancels it.
 * @param {{state?: JobDocument["state"], progress?: JobDocument["progress"] | null} | null} job
 * @param {{label: string, words: string, cancel: () => unknown, verb?: string}} how `label`: of the bar
 */
export function jobRow(job, { label, words, cancel, verb = "Cancel" }) {
  return html`<div class="job running">
    <div class="words">${words}</div>
    <div class="progress">${bar(label, { share: shareOf(job?.progress), text: words })}</div>
    ${textButton(verb, cancel, { disabled: job?.state === "cancelling" })}
  </div>`;
}

/**
 * Put these children into an element, and hide it when there are none.
 * @param {HTMLElement} place
 * @param {Child | Child[]} children
 */
export function show(place, children) {
  const list = [children].flat();
  place.hidden = list.every((child) => !child);
  fill(place, ...list);
}
