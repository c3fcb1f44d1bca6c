// Lists the calibrations of this rig: put one in use, report, export, discard, import, compare two.

import { absent, fill, h, html, repeat, setText, update } from "../../../elements/dom.js";
import { MISSING, number, span } from "../../../elements/format.js";
import { icon } from "../../../elements/icons.js";
import { facts } from "../facts.js";
import { makeImporter } from "./importer.js";
import { badge, figures, keptButton, nothing, textButton, toolButton } from "../../../elements/parts.js";
import { API } from "../../../root.js";
import { offers } from "../../../operating/session/words.js";
import { waiting } from "../../../elements/waiting.js";

/**
 * @import { CalibrationDocument, ComparisonDocument } from "#api"
 * @import { WizardContext } from "../page.js"
 */

const ORIGINS = Object.freeze(
  /** @type {Record<string, string>} */ ({
    factory: "factory",
    measured: "measured",
    corrected: "corrected for drift",
    imported: "imported",
  }),
);

/** @param {HTMLElement} place @param {WizardContext} context */
export function mountRecords(place, context) {
  const { store } = context;
  /** @type {Set<string>} */
  const picked = new Set();
  const list = h("ul", { class: "records" });
  const compared = h("div", { class: "compared", hidden: true });
  const compare = keptButton("Compare", () => act(), { picture: "scales" });
  const hint = h("span", { class: "why", role: "status" });
  const act = async () => {
    const [a, b] = [...picked];
    if (!a || !b) return;
    compare.disabled = true;
    setText(hint, "Comparing …");
    const found = await context.orders.compare(a, b);
    choose();
    if (!found || picked.size !== 2) return;
    fill(compared, ...comparisonOf(found, store.state.records ?? []));
    compared.hidden = false;
  };
  const choose = () => {
    if (picked.size !== 2) compared.hidden = true;
    compare.disabled = picked.size !== 2;
    setText(hint, picked.size === 2 ? "" : picked.size > 2 ? "Two at a time." : "Tick two records to compare them.");
  };
  const pick = (/** @type {string} */ id, /** @type {boolean} */ on) => {
    if (on) picked.add(id);
    else picked.delete(id);
    show();
  };
  const empty = h("div", {});
  const show = () => {
    const { records, rig } = store.state;
    const in_use = rig?.calibration?.id;
    for (const id of picked) if (!records?.some((record) => record.id === id)) picked.delete(id);
    const rows = (records ?? []).map((record) => ({ ...record, current: rig ? record.id === in_use : record.current }));
    update(
      list,
      repeat(
        rows,
        ({ id }) => id,
        (record) => row(record, { ...context, ticked: picked.has(record.id), pick }),
      ),
    );
    fill(
      empty,
      records === null
        ? waiting("Loading the records")
        : records.length === 0
          ? nothing("No record yet. Calibrate everything, or import a file.")
          : null,
    );
    choose();
  };
  fill(
    place,
    empty,
    list,
    html`<p class="actions"><span class="starter">${compare}${hint}</span>${makeImporter(context)}</p>`,
    compared,
  );
  store.on(["records", "rig"], show);
}

/**
 * @param {CalibrationDocument} record
 * @param {WizardContext & {ticked: boolean, pick: (id: string, on: boolean) => void}} context
 */
function row(record, { store, orders, ticked, pick }) {
  const name = record.label || record.origin;
  const tick = html`<input
    type="checkbox" aria-label="Compare ${name}" .checked=${ticked}
    @change=${(/** @type {{target: HTMLInputElement}} */ { target }) => pick(record.id, target.checked)}
  />`;
  const file = (/** @type {string} */ format, /** @type {string} */ text, /** @type {string} */ label, title = "") => {
    const path = `/calibrations/${record.id}/file?format=${format}`;
    const save = (/** @type {Event} */ event) => {
      event.preventDefault();
      void orders.save(path);
    };
    return html`<a href="${API}${path}" aria-label=${label} title=${title || absent} @click=${save}>
      ${icon("down")}${text}
    </a>`;
  };
  return html`<li class=${record.current ? "current" : ""}>
    ${tick}
    <div class="what">
      <p class="name">
        <strong title=${name}>${name}</strong>
        ${record.current && badge("good", "in use")}
        ${record.health?.verdict === "recalibrate" && badge("warn", "recalibrate", record.health.detail)}
      </p>
      <p class="legend">
        <span>${ORIGINS[record.origin] ?? record.origin}</span>
        <time datetime=${record.created_utc} title=${record.created_utc}>${span(record.age_s)} ago</time>
        <span class="number" title=${`${record.id}${record.parent_id ? `, from ${record.parent_id}` : ""}`}>
          ${record.id.slice(0, 10)}
        </span>
        <span class="number">
          ${`mirrors ${record.mirror_sigma_deg === null ? MISSING : `± ${number(record.mirror_sigma_deg, 4)}°`}`}
        </span>
        <span class="number">
          ${`rectified ${record.rectify_sigma_px === null ? MISSING : `± ${number(record.rectify_sigma_px, 2)} px`}`}
        </span>
      </p>
    </div>
    <div class="links">
      ${
        !record.current &&
        offers(store.state.sign_in, "administer") &&
        textButton("Use", () => orders.activate(record.id), { name: `Use ${name}` })
      }
      <a href="${API}/calibrations/${record.id}/report" target="_blank" rel="noopener" aria-label="Report of ${name}">
        ${icon("file")}
        Report
      </a>
      ${file("foveacam", "Export", `Export ${name}`)}
      ${file(
        "authors",
        "Authors’ format",
        `Export ${name} in the authors’ format`,
        "Export in the exchange format of the authors’ application",
      )}
      ${
        record.kept &&
        !record.current &&
        toolButton(`Discard ${name}`, "trash", () => orders.discard(record.id, name), { title: "Put it in the trash" })
      }
    </div>
  </li>`;
}

/** @param {ComparisonDocument} found @param {CalibrationDocument[]} records */
function comparisonOf(found, records) {
  const name = (/** @type {string} */ id) => records.find((record) => record.id === id)?.label || id.slice(0, 10);
  return [
    html`<h4>${name(found.a)} beside ${name(found.b)}</h4>`,
    figures(facts(found, ["a", "b"])),
    found.picture_url ? html`<img src=${found.picture_url} alt="Where both differ, over the field" />` : null,
  ];
}
