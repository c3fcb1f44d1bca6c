// The page of the engine's load: threads, queues, stages, cameras, views, controller's line and clock, start, data flow.

import { request } from "../../transport/api.js";
import { hand } from "../../elements/download.js";
import { fill, h, html, update } from "../../elements/dom.js";
import { count, millis, number } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { pageHead } from "../../pages.js";
import { badge, bar, figures, nothing, panel } from "../../elements/parts.js";
import { QuietReads } from "../../transport/quiet.js";
import { lineOf } from "../../devices/rig/controller.js";
import { flowRows } from "./flow_words.js";
import {
  percent,
  processRows,
  queueRows,
  savedFile,
  stageWords,
  startRow,
  startWords,
  threadName,
  verdict,
  workingAndIdle,
} from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { EngineDocument, MirrorsDocument } from "#api"
 * @import { Store } from "../../store.js"
 * @typedef {{engine: EngineDocument, mirrors: MirrorsDocument}} Load
 * @typedef {{flagged?: boolean, idle?: boolean, cells: unknown[]}} Row the first cell names the row
 */

const READ_MS = 1000;

/** @param {HTMLElement} place @param {{store: Store}} context */
export function mountEnginePage(place, { store }) {
  const [verdictPlace, body] = [h("div", { class: "engine-told", role: "status" }), h("div", { class: "engine-body" })];
  const save = h("button", { type: "button", class: "plain", disabled: true }, icon("down"), "Save as a file");
  const reads = new QuietReads();
  /** @type {Load | null} */
  let load = null;
  const read = async () => {
    if (!store.state.engine_page || document.hidden) return;
    await reads.read("engine", async () => {
      const [engine, mirrors] = await Promise.all([
        /** @type {Promise<EngineDocument>} */ (request("GET", "/engine")),
        /** @type {Promise<MirrorsDocument>} */ (request("GET", "/mirrors")),
      ]);
      load = { engine, mirrors };
      save.disabled = false;
      update(verdictPlace, verdictOf(engine));
      update(body, partsOf(load));
    });
  };
  save.addEventListener("click", () => {
    if (load === null) return;
    const { name, content } = savedFile(load.engine, load.mirrors);
    hand(new Blob([content], { type: "application/json" }), name);
  });
  fill(place, pageHead("engine-title", "Engine", save), verdictPlace, body);
  update(body, waiting("Measuring the load"));
  store.on(["engine_page"], () => void read());
  document.addEventListener("visibilitychange", () => void read());
  setInterval(() => void read(), READ_MS);
}

/** @param {EngineDocument} engine */
function verdictOf(engine) {
  const { tone, sentences } = verdict(engine);
  return sentences.map((text) => html`<p class="state ${tone}">${icon(tone === "good" ? "check" : "warn")}${text}</p>`);
}

/** @param {Load} load */
function partsOf({ engine, mirrors }) {
  return [
    html`<div class="whole-row">${panel("Data flow", flowOf(engine))}</div>`,
    panel("Threads", threadsOf(engine)),
    html`<div class="column">
      ${panel("Queues", figures(queueRows(engine)))} ${panel("Process", figures(processRows(engine)))}
    </div>`,
    panel("Parts of the work, last minute", stagesOf(engine)),
    panel("Cameras", camerasOf(engine)),
    panel("Views", viewsOf(engine)),
    panel("Start", html`<p class="lead">${startWords(engine.process)}</p>`, startOf(engine)),
    panel(
      "Controller",
      mirrors.link
        ? html`<div class="stack">${lineOf(mirrors.link)}</div>`
        : nothing("The controller does not answer."),
    ),
  ];
}

/** @param {EngineDocument} engine */
function flowOf(engine) {
  if (engine.edges.length === 0) return nothing("Nothing has been handed over yet.");
  return tableOf("Data flow", ["From", "To", "Rate", "Data", "In all", "Dropped"], flowRows(engine));
}

/** @param {EngineDocument} engine */
function threadsOf({ threads, window_s }) {
  const { working, idle } = workingAndIdle(threads);
  return html`<div class="stack">
    ${tableOf(
      "Threads",
      ["Thread", window_s === null ? "Of a core" : `Of a core, last ${number(window_s, 0)} s`, ""],
      working.map((thread) => ({
        flagged: thread.flagged,
        cells: [
          threadName(thread),
          shareBar(thread.name, thread.cpu_share),
          thread.flagged && badge("warn", "too busy"),
        ],
      })),
    )}
    ${idle.length > 0 && html`<p class="note">At rest: ${idle.join(", ")}.</p>`}
  </div>`;
}

/** @param {string} name @param {number | null} share */
function shareBar(name, share) {
  const text = percent(share);
  return html`${share !== null && bar(`Load of ${name}`, { share, text })}${text}`;
}

/** @param {EngineDocument} engine */
function stagesOf({ stages }) {
  return tableOf(
    "Parts of the work",
    ["", "Times", "Per second", "Median", "99 % within"],
    stages.map(({ stage, count: times, rate_hz, median_ms, p99_ms }) => ({
      cells: [stageWords(stage), count(times), number(rate_hz, 2), millis(median_ms), millis(p99_ms)],
    })),
  );
}

/** @param {EngineDocument} engine */
function camerasOf({ cameras }) {
  if (cameras.length === 0) return nothing("The rig is opening.");
  return tableOf(
    "Cameras",
    ["", "Rate", "Worst gap, 10 s", "Lost, 1 min", "Delivered", "Skipped", "Dropped", "Incomplete", "Late", "Underrun"],
    cameras.map((camera) => ({
      flagged: camera.flagged,
      cells: [
        camera.role,
        camera.connected ? `${number(camera.rate_hz, 1)} Hz` : badge("bad", "not connected"),
        millis(camera.worst_gap_ms),
        ...[camera.lost_last_minute, camera.delivered, camera.skipped].map(count),
        ...[camera.dropped, camera.incomplete, camera.late, camera.underrun].map(count),
      ],
    })),
  );
}

/** @param {EngineDocument} engine */
function viewsOf({ views }) {
  if (views.length === 0) return nothing("No picture has been published yet.");
  return html`<div class="stack">
    ${tableOf(
      "Views",
      ["", "Rate", "Wanted", "Published", "Repeated", "Sent", "Dropped"],
      views.map((view) => ({
        flagged: view.slow_reason !== null,
        cells: [
          view.view.replaceAll("_", " "),
          `${number(view.rate_hz, 1)} Hz`,
          view.expected_hz === null ? "" : `${number(view.expected_hz, 1)} Hz`,
          ...[view.published, view.repeated, view.sent, view.dropped].map(count),
        ],
      })),
    )}
    <p class="note">Dropped: a newer picture came before the page took this one. A slow page drops more, and is never late.</p>
  </div>`;
}

/** @param {EngineDocument} engine */
function startOf({ start }) {
  return tableOf(
    "Start",
    ["Step", "State", "Began after", "Took"],
    start.map((step) => ({ cells: startRow(step), flagged: step.state === "failed" })),
  );
}

/** @param {string} label @param {string[]} titles @param {Row[]} rows */
function tableOf(label, titles, rows) {
  return html`<div class="scroll-x" tabindex="0" role="group" aria-label=${`${label}, table`}>
    <table class="compare" aria-label=${label}>
      <thead><tr>${titles.map((title) => html`<th scope="col">${title}</th>`)}</tr></thead>
      <tbody>
        ${rows.map(
          ({ flagged, idle, cells: [name, ...cells] }) =>
            html`<tr class=${flagged ? "flagged" : idle ? "idle" : ""}>
            <th scope="row">${name}</th>
            ${cells.map((cell) => html`<td>${cell}</td>`)}
          </tr>`,
        )}
      </tbody>
    </table>
  </div>`;
}
