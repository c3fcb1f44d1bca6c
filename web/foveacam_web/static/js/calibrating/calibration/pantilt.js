// Controls the pan-tilt: its angles, turning by steps or to a station, stopping; or instructions to turn the rig by
// hand.

import { changing, fill, h, html, setText } from "../../elements/dom.js";
import { angle, MISSING, number, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { nextStep, stateWord } from "../../devices/rig/positioner_words.js";
import { zeroOf } from "../../devices/rig/zero.js";
import { choiceField, keptButton, nothing, textButton } from "../../elements/parts.js";
import { isRunning } from "./state.js";

/**
 * @import { PanTiltDocument, StationDocument } from "#api"
 * @import { Store, Work } from "#console"
 * @import { CalibrationOrders } from "./orders.js"
 */

/** @type {[string, string][]} */
const STEPS = [
  ["0.1", "0.1°"],
  ["0.5", "0.5°"],
  ["2", "2°"],
  ["10", "10°"],
];

/** @param {HTMLElement} place @param {{store: Store, orders: CalibrationOrders}} context */
export function mountPanTilt(place, context) {
  const { store } = context;
  const state = h("div", {});
  const zero = zeroOf("pan-tilt", () => void context.orders.confirmZero());
  const drive = driveOf(context);
  const stations = h("div", { class: "stations" });
  fill(place, state, zero.element, drive.element, stations);
  const showState = changing(state, stateOf);
  const showStations = changing(stations, (/** @type {{pan_tilt: PanTiltDocument | null, busy: boolean}} */ now) =>
    stationsOf(now, context),
  );
  store.on(["pan_tilt", "work"], ({ pan_tilt, work }) => {
    const busy = isRunning(work);
    showState({ pan_tilt, work: pan_tilt && !pan_tilt.moves_itself && busy && isTurned(work) ? work : null });
    zero.update(pan_tilt, busy);
    drive.update(pan_tilt, busy);
    showStations({ pan_tilt: pan_tilt && { ...pan_tilt, pan_deg: null, tilt_deg: null, moving: false }, busy });
  });
}

/** Return whether the note of a procedure says where to turn; between turns, that of an acceptance names a check. @param {Work | null} work */
function isTurned(work) {
  return work?.step !== "acceptance" || work.note.startsWith("turn the rig");
}

/** @param {{pan_tilt: PanTiltDocument | null, work: Work | null}} now */
function stateOf({ pan_tilt, work }) {
  if (!pan_tilt) return [nothing("The pan-tilt has not answered yet.")];
  if (!pan_tilt.present) {
    return [
      html`<p class="lead">This rig has no pan-tilt, and none by hand is set up.</p>`,
      html`<p class="remedy">
        The mirrors' sweep needs the rig to be turned: name a pan-tilt, or “manual”, in the rig's file. The other
        steps work without.
      </p>`,
    ];
  }
  if (pan_tilt.fault)
    return [
      html`<p class="state bad">${icon("warn")}Pan-tilt not usable</p>`,
      html`<p class="lead">${sentence(pan_tilt.fault)}</p>`,
    ];
  if (!pan_tilt.moves_itself) return byHand(work);
  const tone = !pan_tilt.connected ? "bad" : pan_tilt.homed || pan_tilt.moving ? "good" : "";
  return [
    html`<p class="pose number">
      <span class="lamp ${tone}"></span>
      pan ${angle(pan_tilt.pan_deg)}  tilt ${angle(pan_tilt.tilt_deg)}
    </p>`,
    html`<p class="lead">${stateWord(pan_tilt, "turning")}${reach(pan_tilt)}</p>`,
  ];
}

/** @param {PanTiltDocument} pan_tilt */
function reach({ limits }) {
  if (!limits) return "";
  const range = (/** @type {number} */ low, /** @type {number} */ high) => `${number(low, 0)}° … ${number(high, 0)}°`;
  return `; reaches ${range(limits.pan_min_deg, limits.pan_max_deg)} × ${range(limits.tilt_min_deg, limits.tilt_max_deg)}`;
}

/** @param {Work | null} work */
function byHand(work) {
  const wanted = work?.note
    ? h("p", { class: "order", role: "status", text: sentence(work.note) })
    : h("p", {
        class: "lead",
        text: "Start a step: the direction to turn appears here, and each pose is taken automatically once the rig is near and still.",
      });
  return [
    html`<p class="state warn">${icon("hand")}You turn the rig</p>`,
    wanted,
    html`<ol class="how">
      <li>Turn the rig until the requested bearing is reached; pan is positive to the right, tilt downwards.</li>
      <li>Let go, and hold still until the number of poses goes up.</li>
      <li>Skip none: a pose that cannot be reached may be left by cancelling; what was measured is kept.</li>
    </ol>`,
  ];
}

/** @param {{store: Store, orders: CalibrationOrders}} context */
function driveOf({ store, orders }) {
  const step = choiceField("Step", STEPS);
  step.input.value = "2";
  const by = (/** @type {number} */ pan, /** @type {number} */ tilt) => {
    const { pan_tilt } = store.state;
    if (pan_tilt?.pan_deg == null || pan_tilt.tilt_deg == null) return;
    const size = Number(step.value());
    void orders.turn({ pan_deg: pan_tilt.pan_deg + pan * size, tilt_deg: pan_tilt.tilt_deg + tilt * size });
  };
  const arrow = (
    /** @type {string} */ label,
    /** @type {"up" | "low" | "back" | "on"} */ name,
    /** @type {number} */ pan,
    /** @type {number} */ tilt,
  ) =>
    h(
      "button",
      {
        type: "button",
        class: `plain jog ${name}`,
        "aria-label": label,
        title: label,
        on: { click: () => by(pan, tilt) },
      },
      icon(name),
    );
  const arrows = [
    arrow("Turn up", "up", 0, -1),
    arrow("Turn left", "back", -1, 0),
    arrow("Turn right", "on", 1, 0),
    arrow("Turn down", "low", 0, 1),
  ];
  const hold = textButton("Hold", () => orders.hold(), { kind: "plain hold", title: "Stop turning now" });
  const home = keptButton("Home", () => orders.home());
  const reason = h("p", { class: "why", role: "status" });
  const element = h(
    "div",
    { class: "drive" },
    html`<div class="pad" role="group" aria-label="Turn the rig">${arrows}${hold}</div>`,
    html`<div class="beside">${step.element}${home}${reason}</div>`,
  );
  return {
    element,
    update: (/** @type {PanTiltDocument | null} */ pan_tilt, /** @type {boolean} */ busy) => {
      element.hidden = !pan_tilt?.present || !pan_tilt.moves_itself || Boolean(pan_tilt.fault && !pan_tilt.connected);
      const where = pan_tilt?.pan_deg != null && pan_tilt.connected;
      for (const button of arrows) button.disabled = busy || !where;
      home.hidden = Boolean(pan_tilt?.awaits_zero);
      home.disabled = busy || !pan_tilt?.connected;
      setText(reason, busy ? "The procedure turns it." : nextStep(pan_tilt, "points"));
    },
  };
}

/** @param {{pan_tilt: PanTiltDocument | null, busy: boolean}} now @param {{orders: CalibrationOrders}} context */
function stationsOf({ pan_tilt, busy }, { orders }) {
  if (!pan_tilt?.present) return [];
  if (pan_tilt.stations.length === 0)
    return [
      html`<h4>Stations</h4>`,
      nothing("None is set up. Name them in the rig's file: their direction, and what is mounted there."),
    ];
  return [
    html`<h4>Stations</h4>`,
    html`<ul>
      ${pan_tilt.stations.map(
        (station) =>
          html`<li>
          <span class="name">${station.name}</span>
          <span class="where">
            ${`${station.target === "board" ? "board" : "markers"}${station.distance_m === null ? "" : `, ${number(station.distance_m, 2)} m`}; ${turnOf(station)}`}
          </span>
          ${
            pan_tilt.moves_itself &&
            textButton("Go", () => orders.turn({ station: station.name }), {
              name: `Turn to the station ${station.name}`,
              disabled: busy || !pan_tilt.connected || Boolean(pan_tilt.fault),
            })
          }
        </li>`,
      )}
    </ul>`,
  ];
}

/** @param {StationDocument} station */
function turnOf({ pan_deg, tilt_deg }) {
  return Number.isFinite(pan_deg) ? `pan ${angle(pan_deg, 0)}, tilt ${angle(tilt_deg, 0)}` : MISSING;
}
