// Controls for what a camera sets by itself: the mode of its exposure, the checkbox of its frame rate, where it has
// them.

import { changing, h, html, setText } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";

/**
 * @import { CameraDocument, CameraPatch } from "#api"
 * @import { ExposureAuto } from "#page"
 * @typedef {(patch: CameraPatch) => Promise<{refusal: string | null}>} Ask
 * @typedef {{
 *   element: HTMLElement, below: HTMLElement,
 *   update: (camera: CameraDocument | undefined, open: boolean) => boolean
 * }} Automatic `below`: its message; `update` returns whether the camera sets the value itself now
 */

/** @type {Readonly<Record<ExposureAuto, string>>} */
const MODES = Object.freeze({ off: "Off", once: "Once", continuous: "Continuous" });
const READ_BACK = "Set by the camera, read back once a second.";
/** @type {Readonly<Record<ExposureAuto, string>>} */
const SAID = Object.freeze({ off: "", once: "The camera is looking for an exposure…", continuous: READ_BACK });

/**
 * Build the choice of the automatic exposure: off, once or continuous.
 * @param {string} of the camera's name
 * @param {Ask} ask
 * @returns {Automatic}
 */
export function exposureMode(of, ask) {
  const input = h("select", {
    "aria-label": `Automatic exposure of the ${of}`,
    on: { change: () => void order.send({ exposure_auto: /** @type {ExposureAuto} */ (input.value) }) },
  });
  const element = h("span", { class: "itself" }, html`<span aria-hidden="true">Automatic</span>`, input);
  const offer = changing(input, (/** @type {ExposureAuto[]} */ modes) =>
    modes.map((value) => html`<option value=${value}>${MODES[value]}</option>`),
  );
  const order = makeOrder(ask, (camera, open, busy) => {
    const has = camera?.ranges?.exposure_auto ?? [];
    const now = camera?.settings?.exposure_auto ?? "off";
    offer([...new Set([...has, now])]);
    element.hidden = has.length < 2;
    input.disabled = !open || busy;
    if (!busy && input.value !== now) input.value = now;
    const looks = busy && input.value === "once" && camera?.settings?.trigger === "hardware";
    return { itself: now !== "off", words: looks ? "Looking for one exposure for both foveae…" : SAID[now] };
  });
  return { element, below: order.status, update: order.update };
}

/**
 * Build the checkbox for a frame rate that the camera sets itself.
 * @param {string} of the camera's name
 * @param {Ask} ask
 * @returns {Automatic}
 */
export function ownRate(of, ask) {
  const input = h("input", {
    type: "checkbox",
    "aria-label": `Automatic frame rate of the ${of}`,
    on: { change: () => void order.send({ frame_rate_auto: input.checked }) },
  });
  const element = h("label", { class: "itself" }, input, html`<span aria-hidden="true">automatic</span>`);
  const order = makeOrder(ask, (camera, open, busy) => {
    const now = camera?.settings?.frame_rate_auto ?? false;
    element.hidden = !camera?.ranges?.frame_rate_auto && !now;
    input.disabled = !open || busy;
    if (!busy) input.checked = now;
    return { itself: now, words: now ? READ_BACK : "" };
  });
  return { element, below: order.status, update: order.update };
}

/**
 * Send one change at a time, and show its state or why it was refused.
 * @param {Ask} ask
 * @param {(camera: CameraDocument | undefined, open: boolean, busy: boolean) => {itself: boolean, words: string}} show
 */
function makeOrder(ask, show) {
  const note = h("p", { class: "aside-note", role: "status" });
  const refused = h("p", { class: "refused", role: "alert" });
  /** @type {{camera: CameraDocument | undefined, open: boolean}} */
  let seen = { camera: undefined, open: false };
  let busy = false;
  const update = (/** @type {CameraDocument | undefined} */ camera, /** @type {boolean} */ open) => {
    seen = { camera, open };
    const { itself, words } = show(camera, open, busy);
    setText(note, words);
    return itself;
  };
  const send = async (/** @type {CameraPatch} */ patch) => {
    busy = true;
    setText(refused, "");
    update(seen.camera, seen.open);
    try {
      const { refusal } = await ask(patch);
      setText(refused, refusal ? sentence(refusal) : "");
    } finally {
      busy = false;
      update(seen.camera, seen.open);
    }
  };
  return { status: h("div", { class: "itself-told" }, note, refused), update, send };
}
