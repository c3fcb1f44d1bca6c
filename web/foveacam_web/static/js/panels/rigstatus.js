// Shows the state of every device in tables: cameras, views, mirrors and controller, calibration, clock.

import { addressOf } from "../calibration/route.js";
import { healthReason, healthWord } from "../calibration/verdict.js";
import { fill, h } from "../dom.js";
import { RIG_ADDRESS } from "../rig/route.js";
import { angle, baseline, clockTime, count, millis, MISSING, number, span } from "../format.js";

/**
 * @import { CameraDocument, MirrorsDocument, RigDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { Store } from "../store.js"
 */

/**
 * @param {HTMLElement} place
 * @param {Store} store
 */
export function mountRigStatus(place, store) {
  store.on(["rig", "server_stats", "overlay", "health"], (state) => {
    if (place.hidden) return;
    if (!state.rig) fill(place, h("p", { class: "empty", text: "Loading …" }));
    else fill(place, ...tables(state, state.rig));
  });
}

/**
 * @param {ConsoleState} state
 * @param {RigDocument} rig
 */
function tables(state, rig) {
  return [
    h(
      "table",
      { class: "status" },
      h("caption", { text: "Cameras" }),
      head(["", "Camera", "Rate", "Age", "Dropped"]),
      h("tbody", {}, rig.cameras.map(cameraRow)),
    ),
    h(
      "table",
      { class: "status" },
      h("caption", { text: "Views" }),
      head(["", "Served", "Shown", "Age"]),
      h("tbody", {}, viewRows(state)),
    ),
    h("p", { class: "more" }, h("a", { href: RIG_ADDRESS, text: "Set cameras, test the trigger, see the controller" })),
    pairs("Mirrors", mirrorRows(rig.mirrors, state)),
    pairs("Calibration", calibrationRows(rig, state.health)),
    pairs("Server", [
      ["Clock", clockTime(rig.clock.utc)],
      ["Rig", `${rig.name} (${rig.rig_id ?? MISSING})`],
      ["Scene", rig.scene ?? MISSING],
      ["Baseline", baseline(rig.baseline_m)],
    ]),
  ];
}

/** @param {string[]} names */
function head(names) {
  return h(
    "thead",
    {},
    h(
      "tr",
      {},
      names.map((text) => h("th", { scope: "col", class: text === "Camera" ? "device" : "", text })),
    ),
  );
}

/** @param {CameraDocument} camera */
function cameraRow(camera) {
  const name = [camera.vendor, camera.model].filter(Boolean).join(" ") || MISSING;
  const state = camera.connected
    ? h("span", { class: "lamp good", title: "connected" })
    : h("span", { class: "lamp bad", title: "missing" });
  const exposure = camera.exposure_ms === null ? "" : `, ${number(camera.exposure_ms, 2)} ms`;
  return h(
    "tr",
    { class: camera.connected ? "" : "missing" },
    h("th", { scope: "row" }, state, camera.role),
    h("td", {
      class: "device",
      title: `${name} ${camera.serial ?? ""}, ${camera.width ?? MISSING} × ${camera.height ?? MISSING} px${exposure}`,
      text: camera.connected ? name : "missing",
    }),
    h("td", { text: camera.frame_rate_hz === null ? MISSING : `${number(camera.frame_rate_hz, 1)} Hz` }),
    h("td", { text: millis(camera.frame_age_ms) }),
    h("td", {
      text: count(camera.dropped),
      title: `${count(camera.delivered)} delivered, ${count(camera.skipped)} skipped for newer ones`,
    }),
  );
}

/** @param {ConsoleState} state */
function viewRows({ views, server_stats, shown }) {
  return views
    .filter(({ name }) => shown[name]?.count)
    .map(({ name }) => {
      const served = server_stats[name];
      return h(
        "tr",
        {},
        h("th", { scope: "row", text: name }),
        h("td", {
          text: served?.rate_hz === null || served === undefined ? MISSING : `${number(served.rate_hz, 1)} Hz`,
        }),
        h("td", { text: `${number(shown[name]?.fps, 1)} fps` }),
        h("td", { text: millis(shown[name]?.age_ms) }),
      );
    });
}

/**
 * @param {MirrorsDocument | null} mirrors
 * @param {ConsoleState} state
 * @returns {[string, string | Node][]}
 */
function mirrorRows(mirrors, { overlay }) {
  if (!mirrors) return [["Controller", "not there"]];
  const lamp = mirrors.fault ? "bad" : mirrors.connected ? "good" : "bad";
  const word = mirrors.fault ?? (mirrors.connected ? (mirrors.enabled ? "enabled" : "connected, parked") : "missing");
  const gaze = mirrors.connected ? overlay?.gaze : null;
  const left = gaze?.left ?? mirrors.left;
  const right = gaze?.right ?? mirrors.right;
  const verge = left?.ax_deg != null && right?.ax_deg != null ? angle(left.ax_deg - right.ax_deg, 3) : MISSING;
  const eye = (/** @type {typeof left} */ looks, /** @type {import("#api").EyeDocument | null} */ pose) =>
    `${angle(looks?.ax_deg)} ${angle(looks?.ay_deg)}  (${number(pose?.x_v, 2)} V, ${number(pose?.y_v, 2)} V)`;
  return [
    ["Controller", h("span", {}, h("span", { class: `lamp ${lamp}` }), word)],
    ["Left eye", eye(left, mirrors.left)],
    ["Right eye", eye(right, mirrors.right)],
    ["Vergence", verge],
    ["Round trip", `${millis(mirrors.rtt_p50_ms)} median, ${millis(mirrors.rtt_p99_ms)} p99`],
    ["Packets", `${count(mirrors.tx_packets)} out, ${count(mirrors.rx_packets)} in, ${count(mirrors.bad_packets)} bad`],
    ["Clock offset", mirrors.clock_offset_ms === null ? MISSING : `${number(mirrors.clock_offset_ms / 1000, 6)} s`],
  ];
}

/**
 * @param {RigDocument} rig
 * @param {ConsoleState["health"]} health
 * @returns {[string, string | Node][]}
 */
function calibrationRows({ calibration, calibration_problem, steering }, health) {
  const calibrate = h("a", { href: addressOf("overview"), text: "Calibrate, check, records" });
  if (!calibration)
    return [
      ["State", calibration_problem ?? "none"],
      ["", calibrate],
    ];
  const field = steering
    ? `${number(steering.ax_min_deg, 1)}° … ${number(steering.ax_max_deg, 1)}° × ${number(steering.ay_min_deg, 1)}° … ${number(steering.ay_max_deg, 1)}°`
    : MISSING;
  return [
    ["Name", calibration.label || calibration.origin],
    ["Origin", calibration.origin],
    ["Id", calibration.id.slice(0, 16)],
    ["Age", span(calibration.age_s)],
    ["Health", healthOf(health)],
    ["Mirror σ", calibration.mirror_sigma_deg === null ? MISSING : `${number(calibration.mirror_sigma_deg, 4)}°`],
    [
      "Rectification σ",
      calibration.rectify_sigma_px === null ? MISSING : `${number(calibration.rectify_sigma_px, 2)} px`,
    ],
    ["Steerable", field],
    ["", calibrate],
  ];
}

/** @param {ConsoleState["health"]} health */
function healthOf(health) {
  const word = healthWord(health);
  const tone = health?.verdict === "good" ? "good" : health?.verdict === "recalibrate" ? "warn" : "";
  return h("span", {}, h("span", { class: `lamp ${tone}` }), health ? `${word}: ${healthReason(health)}` : word);
}

/**
 * @param {string} caption
 * @param {[string, string | Node][]} rows
 */
function pairs(caption, rows) {
  return h(
    "table",
    { class: "status pairs" },
    h("caption", { text: caption }),
    h(
      "tbody",
      {},
      rows.map(([name, value]) =>
        h("tr", {}, h("th", { scope: "row", text: name }), h("td", { class: "long" }, value)),
      ),
    ),
  );
}
