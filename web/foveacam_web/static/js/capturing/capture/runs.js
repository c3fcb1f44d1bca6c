// Shows the running capture: progress, time left, pause, cancel; after its end the result, the reason, and a link to
// it.

import { bar, keptButton } from "../../elements/parts.js";
import { fill, h, html, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { isCapturing, shareOf } from "./state.js";
import { galleryAddress } from "../../addresses.js";
import { endWords, farWords, stateWords } from "./words.js";

/**
 * @import { CaptureEnd, Capturing, Store } from "#console"
 * @import { CaptureOrders } from "./orders.js"
 * @import { CaptureReader } from "./reader.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: CaptureOrders, reader: CaptureReader}} context */
export function mountRuns(place, { store, orders, reader }) {
  const status = h("div", { class: "unseen", "aria-live": "polite" });
  const shown = h("div", { class: "run-now", role: "group", "aria-label": "The capture" });
  const words = h("div", { class: "words" });
  const progress = h("div", { class: "progress" });
  const button = (/** @type {string} */ text, /** @type {() => unknown} */ act, kind = "plain") =>
    keptButton(text, () => act(), { kind: kind });
  const parts = {
    pause: button("Pause", () => orders.pause()),
    onward: button("Go on", () => orders.goOn(), "plain primary"),
    cancel: button("Cancel", () => orders.cancel()),
    resume: button("Resume", () => resumeLast(store, orders), "plain primary"),
    look: h("a", { class: "plain" }, icon("pictures"), "Show in the gallery"),
    mosaic: h("a", { class: "plain" }, "Mosaic"),
    dismiss: h(
      "button",
      { type: "button", class: "tool", "aria-label": "Dismiss", on: { click: () => reader.dismiss() } },
      icon("close"),
    ),
  };
  fill(shown, words, progress, ...Object.values(parts));
  fill(place, shown, status);
  store.on(["capturing"], ({ capturing }) => {
    shown.hidden = capturing === null;
    if (!capturing) return;
    fill(words, ...(capturing.end ? endedWords({ ...capturing, end: capturing.end }) : runningWords(capturing)));
    fill(
      progress,
      !capturing.end && bar(`Capture ${capturing.name}`, { share: shareOf(capturing), text: farWords(capturing) }),
    );
    progress.hidden = capturing.end !== null;
    shown.className = `run-now ${capturing.end ? endWords({ ...capturing, end: capturing.end }).tone : capturing.why ? "warn" : "running"}`;
    showButtons(parts, capturing);
    setText(status, announcement(capturing));
  });
}

/**
 * @param {Record<"pause" | "onward" | "cancel" | "resume" | "dismiss", HTMLButtonElement> & Record<"look" | "mosaic", HTMLAnchorElement>} parts
 * @param {Capturing} capturing
 */
function showButtons({ pause, onward, cancel, resume, look, mosaic, dismiss }, capturing) {
  const { state, asked, end, why, capture_id } = capturing;
  const runs = isCapturing(capturing);
  pause.hidden = !runs || state === "paused";
  pause.disabled = capture_id === null || state === "starting" || asked !== null;
  onward.hidden = !runs || state !== "paused";
  onward.disabled = asked !== null;
  setText(onward, why ? "Done, go on" : "Go on");
  cancel.hidden = !runs;
  cancel.disabled = asked === "cancel";
  resume.hidden = !end?.resumable;
  look.hidden = end === null || end.state === null || capture_id === null;
  mosaic.hidden = look.hidden || (end?.taken ?? 0) < 2;
  if (capture_id !== null) {
    look.href = galleryAddress("datasets", capture_id);
    mosaic.href = galleryAddress("datasets", capture_id, "mosaic");
  }
  dismiss.hidden = runs;
}

/** @param {Store} store @param {CaptureOrders} orders */
function resumeLast(store, orders) {
  const { capturing, captures } = store.state;
  const capture = captures?.find(({ id }) => id === capturing?.capture_id);
  return capture ? orders.resume(capture) : Promise.resolve();
}

/** @param {Capturing} capturing */
function runningWords(capturing) {
  const { name, why, progress, state } = capturing;
  const far = [stateWords(capturing), farWords(capturing)].filter(Boolean).join(": ");
  const still = state === "paused" ? icon("hand") : h("span", { class: "spinner", "aria-hidden": "true" });
  return [
    html`<p class="state ${why ? "warn" : "running"}">
      ${still}
      <span class="name">${name || "A capture"}</span>
      <span class="far number">${far}</span>
    </p>`,
    why
      ? html`<p class="order" role="status">${sentence(why)}</p>`
      : html`<p class="note">${progress?.phase !== "survey" && sentence(progress?.note)}</p>`,
  ];
}

/** @param {Capturing & {end: CaptureEnd}} capturing */
function endedWords(capturing) {
  const { tone, head, why, remedy } = endWords(capturing);
  return [
    html`<p class="state ${tone}">
      ${icon(tone === "good" ? "check" : "warn")}
      <span class="name">${head}</span>
    </p>`,
    html`<p class="lead">${why}</p>`,
    remedy && html`<p class="remedy">${remedy}</p>`,
  ];
}

/** Return the text for screen readers: each state and each quarter, not every point. @param {Capturing} capturing */
function announcement(capturing) {
  if (capturing.end) return endWords({ ...capturing, end: capturing.end }).head;
  const share = shareOf(capturing);
  return `${capturing.name} ${stateWords(capturing)}${share === null ? "" : ` ${Math.floor(share * 4) * 25} %`}. ${capturing.why}`;
}
