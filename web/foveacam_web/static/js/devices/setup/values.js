// The values of the draft besides its cameras: rig, controller, pan-tilt, markers; with the buttons that try them.

import { ask } from "../../elements/ask.js";
import { panel, textButton } from "../../elements/parts.js";
import { html } from "../../elements/dom.js";
import { chooser, fieldOf, notesBeside } from "./fields.js";
import { CAMERAS } from "../rig/words.js";
import { withValue } from "./words.js";

/**
 * @import { FoundPortDocument, RigDraft, TryResult } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { Field } from "./fields.js"
 * @import { SetupOrders } from "./orders.js"
 */

/** @type {Field[]} */
const RIG = [
  { path: "name", label: "Nickname", kind: "text" },
  {
    path: "rig_id",
    label: "Short name",
    kind: "text",
    title: "Names the file and the rig in its calibrations: small letters, digits, hyphens",
  },
  {
    path: "baseline_mm",
    label: "Baseline",
    unit: "mm",
    title: "Between the mirrors, as built; a calibration measures it better",
  },
];
/** @type {Field[]} */
const CONTROLLER = [
  {
    path: "mirrors.max_v",
    label: "Largest drive",
    unit: "V",
    title: "Beyond it every move is refused; from the mirrors' data sheet",
  },
  { path: "mirrors.bias_v", label: "Bias", unit: "V" },
  {
    path: "mirrors.low_pass_hz",
    label: "Drive filter",
    unit: "Hz",
    kind: "whole",
    title: "Cut-off: slows the mirrors' steps down",
  },
  {
    path: "mirrors.settle_us",
    label: "Settle time",
    unit: "µs",
    kind: "whole",
    title: "From a move to its exposure; the calibration measures it",
  },
  { path: "mirrors.pulse_us", label: "Trigger pulse", unit: "µs", kind: "whole" },
];
/** @type {Field[]} */
const MARKERS = [
  { path: "markers.side_mm", label: "Side", unit: "mm", title: "Of the black square, as printed" },
  { path: "markers.spacing_mm", label: "Spacing", unit: "mm", title: "From the middle marker to each of the others" },
  { path: "markers.wide_id", label: "Id, wide", kind: "whole", title: "Id in the dictionary 4X4_50" },
  { path: "markers.left_id", label: "Id, left", kind: "whole" },
  { path: "markers.right_id", label: "Id, right", kind: "whole" },
];
/** @type {Field[]} */
const TURNED = [
  { path: "pan_tilt.pan_min_deg", label: "Pan from", unit: "°" },
  { path: "pan_tilt.pan_max_deg", label: "to", unit: "°" },
  { path: "pan_tilt.tilt_min_deg", label: "Tilt from", unit: "°" },
  { path: "pan_tilt.tilt_max_deg", label: "to", unit: "°" },
  {
    path: "pan_tilt.zero_pan_deg",
    label: "Pan at zero",
    unit: "°",
    empty: true,
    title: "Where it points at the reference switches",
  },
  { path: "pan_tilt.zero_tilt_deg", label: "Tilt at zero", unit: "°", empty: true },
  { path: "pan_tilt.speed_deg_s", label: "Speed", unit: "°/s" },
];
const PAN_TILTS = [
  { value: "", text: "none" },
  { value: "grbl", text: "Grbl board" },
  { value: "ptu", text: "FLIR unit" },
  { value: "manual", text: "by hand" },
];

const BINNINGS = [
  { value: "", text: "usual" },
  { value: "1", text: "1×1: every pixel" },
  { value: "2", text: "2×2: four are one" },
];

/** @type {Readonly<Record<string, string>>} */
const TABLES = Object.freeze({ mirrors: "Controller", markers: "Markers", pan_tilt: "Pan-tilt" });

/** Return the name of a field as the page shows it. @param {string} path */
export function fieldName(path) {
  const [table = "", key = ""] = path.split(".");
  if (table === "cameras") return CAMERAS[/** @type {import("#page").Role} */ (key)] ?? "Cameras";
  const label = [...RIG, ...CONTROLLER, ...MARKERS, ...TURNED].find((field) => field.path === path)?.label;
  const named = label ?? { port: "Port", working_binning: "Working binning", fovea_trigger: "Trigger" }[key || table];
  return [TABLES[table], named].filter(Boolean).join(", ");
}

/** Every field that the page shows; faults of others stand by themselves. */
export const FIELDS = new Set(
  [...RIG, ...CONTROLLER, ...MARKERS, ...TURNED]
    .map(({ path }) => path)
    .concat(
      "working_binning",
      "mirrors.port",
      "pan_tilt",
      "pan_tilt.port",
      "cameras.wide",
      "cameras.left",
      "cameras.right",
      "cameras",
      "fovea_trigger",
    ),
);

/** @param {ConsoleState} state @param {SetupOrders} orders */
export function valuesOf(state, orders) {
  const { setup } = state;
  if (!setup) return null;
  const fixed = setup.simulated;
  const fields = (/** @type {Field[]} */ list) =>
    html`<div class="fields">${list.map((field) => fieldOf(field, state, orders))}</div>`;
  const simulated = fixed && html`<p class="lead">The simulated rig has its own.</p>`;
  return html`<div class="setup-values">
    ${panel("Rig", html`${fields(fixed ? RIG.slice(0, setup.file_exists ? 1 : 2) : RIG)}${binningOf(state, orders)}`)}
    ${panel("Mirrors' controller", controllerOf(state, orders), simulated, !fixed && fields(CONTROLLER))}
    ${panel("Pan-tilt", simulated, !fixed && panTiltOf(state, orders, fields))}
    ${panel("Markers as printed", simulated, !fixed && fields(MARKERS))}
  </div>`;
}

/** @param {ConsoleState} state @param {SetupOrders} orders */
function binningOf(state, orders) {
  const now = state.setup?.draft.working_binning ?? null;
  const choose = (/** @type {string} */ value) =>
    orders.change((draft) => withValue(draft, "working_binning", value ? Number(value) : null));
  return html`<div
    class="field" title="Pixels of the sensor in one of a picture, for looks, following and live views. Usual: 2×2 simulated, 1×1 real"
  >
    ${chooser({ id: "setup-working_binning", label: "Working binning", choices: BINNINGS, value: now === null ? "" : String(now), change: choose })}
    ${notesBeside("working_binning", state)}
  </div>`;
}

/** @param {ConsoleState} state @param {SetupOrders} orders */
function controllerOf(state, orders) {
  return html`${portField("mirrors.port", "Port", state, orders)}
    <div class="actions">
      ${textButton("Does it answer?", () => orders.try("controller"), {
        disabled: state.tries["controller"] === "asking",
      })}
      ${textButton("Small step of the mirrors", async () => (await ask(STEP)) && void orders.stepMirrors(), {
        title: "Moves both mirrors of the rig that is open by 3 V on each axis, and back",
        disabled: state.tries["mirrors"] === "asking",
      })}
    </div>
    ${resultOf(state.tries["controller"])} ${resultOf(state.tries["mirrors"])}`;
}

const STEP = Object.freeze({
  title: "Small step of the mirrors",
  text: "Both mirrors of the rig that is open move by 3 V on each axis and come back. You take control for it.",
  yes: "Move them",
});

/** @param {ConsoleState} state @param {SetupOrders} orders @param {(list: Field[]) => unknown} fields */
function panTiltOf(state, orders, fields) {
  const now = state.setup?.draft.pan_tilt ?? null;
  const choose = (/** @type {string} */ kind) =>
    orders.change(
      (draft) => /** @type {RigDraft} */ ({ ...draft, pan_tilt: kind ? { ...turned(draft), kind } : null }),
    );
  const motors = now !== null && now.kind !== "manual";
  return html`<div class="field">
      ${chooser({ id: "setup-pan-tilt-kind", label: "Kind", choices: PAN_TILTS, value: now?.kind ?? "", change: choose })}
      ${notesBeside("pan_tilt", state)}
    </div>
    ${motors && portField("pan_tilt.port", "Port", state, orders)} ${motors && fields(TURNED)}
    ${motors && now?.kind === "grbl" && switchesOf(now.has_switches, orders)}
    ${
      now &&
      html`<div class="actions">
        ${textButton("Does it answer?", () => orders.try("pan_tilt"), {
          disabled: state.tries["pan_tilt"] === "asking",
        })}
      </div>`
    }
    ${resultOf(state.tries["pan_tilt"])}`;
}

/** Return a draft's pan-tilt, or one with the usual values. @param {RigDraft} draft */
function turned(draft) {
  return (
    draft.pan_tilt ?? {
      kind: "grbl",
      port: "",
      pan_min_deg: -70,
      pan_max_deg: 70,
      tilt_min_deg: -30,
      tilt_max_deg: 30,
      zero_pan_deg: null,
      zero_tilt_deg: null,
      speed_deg_s: 25,
      has_switches: true,
    }
  );
}

/** @param {boolean} checked @param {SetupOrders} orders */
function switchesOf(checked, orders) {
  return html`<label class="field tick"
    ><input
      type="checkbox" .checked=${checked}
      @change=${(/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget }) =>
        void orders.change((draft) => withValue(draft, "pan_tilt.has_switches", currentTarget.checked))}
    /><span>It has reference switches</span></label
  >`;
}

/**
 * @param {string} path
 * @param {string} label
 * @param {ConsoleState} state
 * @param {SetupOrders} orders
 */
function portField(path, label, state, orders) {
  const list = `setup-ports-${path.split(".")[0]}`;
  const ports = state.found?.ports ?? [];
  return html`<div class="setup-port">
    ${fieldOf({ path, label, kind: "text", title: "A path, usb:SERIAL, or auto: the only controller that is plugged in" }, state, orders)}
    <ul class="ports" id=${list}>
      ${ports.map((port) => portRow(port, path, state, orders))}
      ${path === "mirrors.port" && state.found && ports.length === 0 && html`<li class="note">No serial port was found.</li>`}
    </ul>
  </div>`;
}

/** @param {FoundPortDocument} port @param {string} path @param {ConsoleState} state @param {SetupOrders} orders */
function portRow(port, path, { setup }, orders) {
  const chosen =
    setup !== null && (path === "mirrors.port" ? setup.draft.mirrors.port : setup.draft.pan_tilt?.port) === port.name;
  const about = [
    port.product,
    port.usb_id,
    port.serial && `serial ${port.serial}`,
    port.device !== port.name && port.device,
  ]
    .filter(Boolean)
    .join(" · ");
  const state = port.problem ?? port.in_use;
  return html`<li>
    ${textButton(port.name, () => orders.change((draft) => withValue(draft, path, port.name)), {
      kind: "chip",
      title: about || undefined,
      pressed: chosen,
    })}
    <span class="note">${about}${state && `; ${state}`}</span>
  </li>`;
}

/** @param {TryResult | "asking" | undefined} result */
function resultOf(result) {
  if (!result) return null;
  if (result === "asking")
    return html`<p class="note" role="status"><span class="spinner" aria-hidden="true"></span> It is asked …</p>`;
  return html`<p class="note ${result.good ? "good" : "bad"}" role="status">
    ${result.sentence} ${result.remedy && !result.sentence.includes(result.remedy) ? result.remedy : ""}
  </p>`;
}
