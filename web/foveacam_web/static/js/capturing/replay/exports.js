// Exports of the recording, which the server makes and the browser downloads: films, pictures, arrays.

import { bar, choiceField, numberField, shareOf, tickField } from "../../elements/parts.js";
import { RequestError, request } from "../../transport/api.js";
import { hasEnded, JobFollower } from "../../transport/jobs.js";
import { fill, h, html } from "../../elements/dom.js";
import { count, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";

/**
 * @import { FilmRequest, FormatDocument, RecordingDocument } from "#api"
 * @import { FilmShow, Job } from "#page"
 * @import { Span } from "./scale.js"
 */

/** @type {readonly [FilmShow, string][]} */
const SHOWS = Object.freeze([
  ["wide", "Wide view"],
  ["left", "Left fovea"],
  ["right", "Right fovea"],
  ["side-by-side", "Both foveae, side by side"],
  ["anaglyph", "Both foveae, as an anaglyph"],
]);
const PAIRS = new Set(["side-by-side", "anaglyph"]);

/**
 * @param {RecordingDocument} recording
 * @param {{orders: import("../gallery/recordings.js").RecordingOrders, signal: AbortSignal, span: () => Span}} context
 *   `span`: returns the part that the timeline shows
 */
export function makeExports(recording, { orders, signal, span }) {
  const has = (/** @type {string} */ role) =>
    recording.streams.some((stream) => stream.role === role && stream.frames > 0);
  const shows = SHOWS.filter(([show]) => (PAIRS.has(show) ? has("left") && has("right") : has(show)));
  const show = choiceField("Shows", [...shows], () => allow());
  const format = choiceField("Format", [["h264", "H.264 (.mp4)"]], () => allow());
  const fps = numberField("Frames a second", { min: 0.1, max: 240, step: "any", hint: detected(recording, "wide") });
  const straight = tickField("Without the wide lens' distortion", false);
  const part = tickField("Only what the timeline shows", false);
  const button = h("button", { type: "button", class: "plain" }, icon("down"), "Export");
  const cancel = h("button", { type: "button", class: "plain", hidden: true }, "Cancel");
  const missing = h("p", { class: "why" });
  const far = h("div", { class: "stack", role: "status" });
  const allow = () => {
    const shown = show.value();
    straight.element.hidden = shown !== "wide";
    fps.input.placeholder = detected(recording, PAIRS.has(shown) ? "left" : shown);
    const paired = PAIRS.has(shown) && format.value() === "npy";
    button.disabled = paired;
    button.title = paired ? "An array holds one camera" : "";
  };
  void readFormats(format, missing);
  allow();
  const jobs = new JobFollower({
    news: (job) => {
      showFar(job);
      if (!hasEnded(job.state)) return;
      void orders.notifyEnd(job);
      if (job.state === "succeeded") far.querySelector("a")?.click();
    },
  });
  signal.addEventListener("abort", () => jobs.forget());
  const showFar = (/** @type {Job} */ job) => {
    fill(far, exportWords(job));
    cancel.hidden = !jobs.running;
    if (jobs.running) button.disabled = true;
    else allow();
  };
  cancel.addEventListener("click", () => void jobs.cancel(orders.commands));
  button.addEventListener("click", async () => {
    if (!fps.input.reportValidity()) return;
    button.disabled = true;
    if (!(await orders.start(orders.path(recording.id, "/films"), wish(), jobs))) allow();
  });
  /** @returns {FilmRequest} */
  const wish = () => {
    const { from_s, to_s } = span();
    const chosen = /** @type {FilmShow} */ (show.value());
    return {
      show: chosen,
      format: /** @type {NonNullable<FilmRequest["format"]>} */ (format.value()),
      undistorted: chosen === "wide" && straight.value(),
      fps: fps.value(),
      ...(part.value() ? { start_s: Math.max(0, from_s), end_s: Math.max(0, to_s) } : {}),
    };
  };
  return html`<div class="stack">
    ${show.element} ${format.element} ${fps.element} ${straight.element}
    <div>${part.element}</div>
    <div class="actions">${button} ${cancel}</div>
    ${far} ${missing}
  </div>`;
}

/** @param {ReturnType<typeof choiceField>} format @param {HTMLElement} missing */
async function readFormats(format, missing) {
  try {
    const found = /** @type {FormatDocument[]} */ (await request("GET", "/recordings/formats"));
    fill(
      format.input,
      ...found.map(({ name, title, suffix, available, why }) => {
        const option = h("option", {
          value: name,
          text: available ? `${title} (${suffix})` : `${title}: not here`,
          title: why,
        });
        option.disabled = !available;
        return option;
      }),
    );
    const reasons = found.filter(({ available }) => !available).map(({ title, why }) => sentence(`${title}: ${why}`));
    fill(missing, reasons.join(" "));
  } catch (error) {
    if (!(error instanceof RequestError)) throw error; // the usual format stays
  }
}

/** @param {RecordingDocument} recording @param {string} role */
function detected({ streams }, role) {
  const fps = streams.find((stream) => stream.role === role)?.fps ?? 0;
  return fps > 0 ? `as recorded: ${fps.toFixed(2)}` : "as recorded";
}

/** Show how far the export is, or what became of it. @param {Job} job */
function exportWords({ state, progress, result_url }) {
  if (state === "succeeded") return html`<a href=${result_url} download="">It is made: download it</a>`;
  if (state === "cancelled") return html`<p class="why">Cancelled: nothing is left of it.</p>`;
  if (state === "failed") return null;
  const words = progress?.total ? `${count(progress.done)} of ${count(progress.total)} frames` : "Beginning …";
  return html`${bar("Export", { share: shareOf(progress), text: words })}<p class="why">${words}</p>`;
}
