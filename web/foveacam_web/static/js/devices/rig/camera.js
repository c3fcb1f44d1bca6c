// Builds a camera's column: identity, link with the reason of a fault, live picture, and settings as read back.

import { choiceField, keptButton } from "../../elements/parts.js";
import { changing, h, html, setText } from "../../elements/dom.js";
import { count, millis, MISSING, number, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { exposureMode, ownRate } from "./automatic.js";
import { Dial } from "./dial.js";
import { CAMERAS, linkOf, linkWords, phaseWords, problemOf, settable, SETTINGS, takesOrders } from "./words.js";

/**
 * @import { CameraDocument, CameraPatch } from "#api"
 * @import { CameraNumber, ConsoleState, Role, Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 * @typedef {{store: Store, orders: RigOrders}} Context
 */

/** @type {Readonly<Record<CameraNumber, {kind?: "log", presets?: number[]}>>} */
const LOOKS = Object.freeze({
  exposure_ms: { kind: "log", presets: [8.33, 10, 16.67, 20] },
  gain_db: {},
  black_level: {},
  frame_rate_hz: { presets: [50, 60, 100, 120] },
});
/** @type {CameraNumber[]} */
const NUMBERS = ["exposure_ms", "gain_db", "black_level", "frame_rate_hz"];

/**
 * Build the column of one camera.
 * @param {Role} role
 * @param {Context} context
 * @returns {{element: HTMLElement, place: HTMLElement}} `place`: the slot of its live picture
 */
export function makeCamera(role, { store, orders }) {
  const place = h("div", { class: "live preview" });
  const [head, since, link, facts] = [
    h("span", { class: "mark" }),
    h("span", { class: "since" }),
    h("div", { class: "link-state" }),
    h("div", {}),
  ];
  const controls = makeControls(role, { store, orders });
  const element = h(
    "section",
    { class: `panel camera camera-${role}`, "aria-label": CAMERAS[role], data: { role } },
    html`<header><h3>${CAMERAS[role]}</h3>${since}${head}</header>`,
    html`<div class="inside">${link}${place}${facts}${controls.element}</div>`,
  );
  const showHead = changing(head, headOf);
  const showLink = changing(link, linkRows);
  const showFacts = changing(facts, (/** @type {CameraDocument | null} */ camera) => (camera ? [factsOf(camera)] : []));
  store.on(["rig", "stream", "rig_page"], (state) => {
    if (!state.rig_page) return;
    const camera = state.rig?.cameras.find((each) => each.role === role);
    showHead(camera ? phaseWords(linkOf(camera)) : null);
    setText(since, camera && state.stream !== "down" ? linkWords(linkOf(camera)).since : "");
    showLink(linkNow(state, role, camera));
    showFacts(camera ?? null);
    controls.update(state, camera);
  });
  return { element, place };
}

/** @param {{text: string, tone: string} | null} phase */
function headOf(phase) {
  return phase ? [html`<span class="badge phase ${phase.tone || "plain"}" role="status">${phase.text}</span>`] : [];
}

/** @param {ConsoleState} state @param {Role} role @param {CameraDocument | undefined} camera */
function linkNow({ rig, stream }, role, camera) {
  if (stream === "down")
    return { tone: "bad", reason: "No connection to the server: this is what was last known.", remedy: "" };
  if (!camera) return { tone: "", reason: "The rig is opening; this camera is not known yet.", remedy: "" };
  const link = linkOf(camera);
  const { reason } = linkWords(link);
  const problem = problemOf(rig, role);
  return {
    tone: phaseWords(link).tone,
    reason: problem && !camera.connected ? sentence(problem.detail) : reason,
    remedy: problem?.remedy ?? "",
  };
}

/** @param {{tone: string, reason: string, remedy: string}} now */
function linkRows({ tone, reason, remedy }) {
  return [
    reason && html`<p class="reason ${tone}">${reason}</p>`,
    remedy && !reason.includes(remedy) && html`<p class="remedy">${sentence(remedy)}</p>`,
  ];
}

/** @param {CameraDocument} camera */
function factsOf(camera) {
  const { delivered, skipped, dropped, incomplete, late, underrun } = camera;
  const name = [camera.vendor, camera.model].filter(Boolean).join(" ") || MISSING;
  const size = camera.width && camera.height ? `${camera.width} × ${camera.height} px` : MISSING;
  const lost = (/** @type {number | undefined} */ found) =>
    html`<span class=${found ? "warn-text" : ""}>${count(found)}</span>`;
  const row = (/** @type {string} */ term, /** @type {import("../../elements/dom.js").Child} */ value, title = "") =>
    html`<div title=${title}><dt>${term}</dt><dd class="number">${value}</dd></div>`;
  return html`<div class="facts">
    <p class="who">
      <strong>${name}</strong>
      <span class="number">serial ${camera.serial || MISSING} · firmware ${camera.version || MISSING} · ${size}</span>
    </p>
    <dl class="counters">
      ${row(
        "Rate",
        camera.frame_rate_hz === null ? MISSING : `${number(camera.frame_rate_hz, 1)} Hz`,
        "measured over the last frames",
      )}
      ${row("Age", millis(camera.frame_age_ms), "of the newest frame")}
      ${row("Delivered", count(delivered))}
      ${row("Skipped", count(skipped), "frames that were superseded by a newer one before they were read")}
      ${row("Dropped", lost(dropped), "frames that never came: their numbers are missing")}
      ${row("Incomplete", lost(incomplete), "frames of which a part is missing")}
      ${row("Late", lost(late), "frames that came too late to be used")}
      ${row("Underrun", lost(underrun), "frames for which no buffer was free")}
    </dl>
  </div>`;
}

/** @param {Role} role @param {Context} context */
function makeControls(role, { store, orders }) {
  const linked = (/** @type {ConsoleState} */ { rig }) =>
    role !== "wide" &&
    ["left", "right"].every((eye) => takesOrders(rig?.cameras.find((camera) => camera.role === eye)));
  const ask = async (/** @type {CameraPatch} */ patch, /** @type {boolean} */ pair) => {
    const { changed, refusal } = await orders.change(role, patch, pair && linked(store.state));
    return { camera: changed?.cameras.find((camera) => camera.role === role), refusal };
  };
  const format = makeFormat(ask);
  const of = CAMERAS[role].toLowerCase();
  /** @type {Partial<Record<CameraNumber, import("./automatic.js").Automatic>>} */
  const automatic = {
    exposure_ms: exposureMode(of, (patch) => ask(patch, true)),
    frame_rate_hz: ownRate(of, (patch) => ask(patch, false)),
  };
  const dials = new Map(
    NUMBERS.map((name) => [
      name,
      new Dial({
        ...SETTINGS[name],
        ...LOOKS[name],
        of,
        beside: automatic[name]?.element,
        below: automatic[name]?.below,
        ask: async (value) => {
          const { camera, refusal } = await ask({ [name]: value }, name !== "frame_rate_hz");
          return { taken: camera?.settings?.[name] ?? null, refusal };
        },
      }),
    ]),
  );
  const pace = h("p", { class: "aside-note" });
  const pair = h(
    "p",
    { class: "aside-note linked" },
    icon("link"),
    "Changes apply to both foveae; only the frame rate is set separately.",
  );
  const waits = h("p", { class: "aside-note" }, icon("warn"), "The foveae differ: choose above whose settings apply.");
  const kept = h("span", { class: "why" });
  const reset = keptButton("Reset to the rig file", () => orders.reset(role), { picture: "again" });
  const fields = h(
    "fieldset",
    { class: "controls" },
    html`<legend class="unseen">Settings of the ${of}</legend>`,
    pair,
    waits,
    format.element,
    [...dials.values()].map(({ element }) => element),
    pace,
    html`<div class="actions">${reset}${kept}</div>`,
  );
  return {
    element: fields,
    update: (/** @type {ConsoleState} */ state, /** @type {CameraDocument | undefined} */ camera) => {
      const open = takesOrders(camera) && state.stream !== "down";
      const apart = role !== "wide" && settable(state.rig).length > 0;
      fields.disabled = apart;
      fields.classList.toggle("blocked", apart);
      pair.hidden = !linked(state) || apart;
      waits.hidden = !apart;
      format.update(camera, open);
      for (const [name, dial] of dials) {
        const itself = automatic[name]?.update(camera, open) ?? false;
        dial.update(camera?.ranges?.[name], camera?.settings?.[name], open, itself);
      }
      setText(
        pace,
        camera?.settings?.trigger === "hardware"
          ? "The controller's pulses set its rate; the frame rate applies only when it runs free."
          : "",
      );
      reset.disabled = !camera?.settings?.kept || !open;
      setText(
        kept,
        camera?.settings
          ? camera.settings.kept
            ? "Changed here; applied again at every start."
            : "As in the rig file."
          : "",
      );
    },
  };
}

/** @param {(patch: CameraPatch, pair: boolean) => Promise<{refusal: string | null}>} ask */
function makeFormat(ask) {
  const refused = h("p", { class: "refused", role: "alert" });
  let sending = false;
  const send = async (/** @type {string} */ value) => {
    sending = true;
    const { refusal } = await ask({ pixel_format: /** @type {CameraPatch["pixel_format"]} */ (value) }, true);
    sending = false;
    setText(refused, refusal ? sentence(refusal) : "");
  };
  const field = choiceField(SETTINGS.pixel_format.name, [], (value) => void send(value));
  const offer = changing(field.input, (/** @type {string[]} */ formats) =>
    formats.map((value) => html`<option value=${value}>${value}</option>`),
  );
  const update = (/** @type {CameraDocument | undefined} */ camera, /** @type {boolean} */ open) => {
    const known = camera?.settings?.pixel_format;
    offer([...new Set([...(camera?.ranges?.pixel_formats ?? []), ...(known ? [known] : [])])]);
    field.input.disabled = !open;
    if (known && !sending && document.activeElement !== field.input) field.input.value = known;
    else if (known && !sending && field.input.value === "") field.input.value = known;
  };
  return { element: h("div", { class: "dial" }, html`<div class="line">${field.element}</div>`, refused), update };
}
