// Imports a calibration from a file. The authors' files lack the distance of the markers, so a dialog asks for it.

import { h, html, setText } from "../../../elements/dom.js";
import { icon } from "../../../elements/icons.js";
import { sheet } from "../../../panels/dialogs.js";
import { numberField } from "../../../elements/parts.js";

/** @import { WizardContext } from "../page.js" */

const AUTHORS = "fovea-device-config";

/** @param {WizardContext} context */
export function makeImporter({ store, orders, toasts }) {
  const input = h("input", {
    type: "file",
    accept: ".json,application/json",
    class: "unseen",
    "aria-label": "Import a calibration file",
    on: { change: () => void read() },
  });
  const state = h("span", { class: "why", role: "status" });
  const take = async (/** @type {object} */ document, /** @type {number | null} */ distance_m) => {
    setText(state, "Importing …");
    const record = await orders.importRecord(document, distance_m);
    setText(state, "");
    if (!record) return;
    const in_use = store.state.rig?.calibration?.id === record.id;
    toasts.show({
      tone: "good",
      title: "Imported",
      detail: `“${record.label || record.id}” is in the list; ${in_use ? "it is the one in use" : "it is not in use yet"}.`,
    });
  };
  const ask = makeQuestion(take);
  const read = async () => {
    const file = input.files?.[0];
    input.value = "";
    if (!file) return;
    const document = objectOf(await file.text());
    if (!document) {
      toasts.show({
        tone: "warn",
        title: "Not a calibration file",
        detail: `“${file.name}” is no JSON document: it may be cut short, or another kind of file.`,
        remedy: "Export it again where it came from.",
      });
    } else if (String(/** @type {{schema?: unknown}} */ (document).schema).startsWith(AUTHORS))
      ask(document, file.name);
    else await take(document, null);
  };
  return html`<span class="starter">
    <label class="plain file">${icon("plus")}Import a file${input}</label>
    ${state}
  </span>`;
}

/** @param {string} text @returns {object | null} */
function objectOf(text) {
  try {
    const document = /** @type {unknown} */ (JSON.parse(text));
    return document && typeof document === "object" && !Array.isArray(document) ? document : null;
  } catch {
    return null;
  }
}

/**
 * Build the dialog that asks for the distance of the markers.
 * @param {(document: object, distance_m: number | null) => Promise<void>} take
 */
function makeQuestion(take) {
  /** @type {object | null} */
  let document = null;
  const what = h("p", { class: "lead" });
  const distance = numberField("From the wide camera to the markers", { min: 0.2, max: 1000, step: "any", unit: "m" });
  distance.input.required = true;
  const act = () => {
    if (!document || !distance.input.reportValidity()) return;
    dialog.close();
    void take(document, distance.value());
  };
  const form = h(
    "form",
    {
      class: "run",
      on: {
        submit: (/** @type {Event} */ event) => {
          event.preventDefault();
          act();
        },
      },
    },
    distance.element,
    html`<p class="actions"><button type="submit" class="plain primary">Import</button></p>`,
  );
  const dialog = sheet("How far away were the markers?", what, form);
  return (/** @type {object} */ found, /** @type {string} */ name) => {
    document = found;
    setText(
      what,
      `“${name}” comes from the authors’ application, whose files do not say at which distance the mirrors were measured. Without it the eyes’ parallax cannot be taken out.`,
    );
    dialog.showModal();
  };
}
