// Shows the state of every device in tables: cameras, views, mirrors and controller, calibration, clock.

import { RIG_ADDRESS, wizardAddress } from "../addresses.js";
import { healthReason, healthWord } from "../calibrating/calibration/verdict.js";
import { fill, h, html } from "../elements/dom.js";
import { angle, baseline, clockTime, count, millis, MISSING, number, span } from "../elements/format.js";
import { waiting } from "../elements/waiting.js";

/**
 * @import { CameraDocument, MirrorsDocument, RigDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { Child } from "../elements/dom.js"
 */

/** @param {HTMLElement} place @param {Store} store */
export function mountRigStatus(place, store) {
  let gaze = "";
  const draw = (/** @type {ConsoleState} */ state) => {
    if (place.hidden) return;
    if (!state.rig) fill(place, waiting("Loading the rig"));
    else fill(place, ...tables(state, state.rig));
  };
  store.on(["rig", "server_stats", "health"], draw);
  store.on(["overlay"], (state) => {
    const now = JSON.stringify(state.overlay?.gaze ?? null);
    if (now === gaze) return; // an overlay comes with every frame
    gaze = now;
    draw(state);
  });
}

/** @param {ConsoleState} state @param {RigDocument} rig */
function tables(state, rig) {
  return [
    html`<table class="status">
      <caption>Cameras</caption>
      ${head(["", "Camera", "Rate", "Age", "Dropped"])}
      <tbody>${rig.cameras.map(cameraRow)}</tbody>
    </table>`,
    html`<table class="status">
      <caption>Views</caption>
      ${head(["", "Served", "Shown", "Age"])}
      <tbody>${viewRows(state)}</tbody>
    </table>`,
    html`<p class="more"><a href=${RIG_ADDRESS}>Set cameras, test the trigger, see the controller</a></p>`,
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
  return html`<thead>
    <tr>${names.map((text) => html`<th scope="col" class=${text === "Camera" ? "device" : ""}>${text}</th>`)}</tr>
  </thead>`;
}

/** @param {CameraDocument} camera */
function cameraRow(camera) {
  const name = [camera.vendor, camera.model].filter(Boolean).join(" ") || MISSING;
  const state = camera.connected
    ? h("span", { class: "lamp good", title: "connected" })
    : h("span", { class: "lamp bad", title: "missing" });
  const exposure = camera.exposure_ms === null ? "" : `, ${number(camera.exposure_ms, 2)} ms`;
  return html`<tr class=${camera.connected ? "" : "missing"}>
    <th scope="row">${state}${camera.role}</th>
    <td
      class="device"
      title="${name} ${camera.serial ?? ""}, ${camera.width ?? MISSING} × ${camera.height ?? MISSING} px${exposure}"
    >
      ${camera.connected ? name : "missing"}
    </td>
    <td>${camera.frame_rate_hz === null ? MISSING : `${number(camera.frame_rate_hz, 1)} Hz`}</td>
    <td>${millis(camera.frame_age_ms)}</td>
    <td title="${count(camera.delivered)} delivered, ${count(camera.skipped)} skipped for newer ones">
      ${count(camera.dropped)}
    </td>
  </tr>`;
}

/** @param {ConsoleState} state */
function viewRows({ views, server_stats, shown }) {
  return views
    .filter(({ name }) => shown[name]?.count)
    .map(({ name }) => {
      const served = server_stats[name];
      return html`<tr>
        <th scope="row">${name}</th>
        <td>${served?.rate_hz === null || served === undefined ? MISSING : `${number(served.rate_hz, 1)} Hz`}</td>
        <td>${number(shown[name]?.fps, 1)} fps</td>
        <td>${millis(shown[name]?.age_ms)}</td>
      </tr>`;
    });
}

/** @param {MirrorsDocument | null} mirrors @param {ConsoleState} state @returns {[string, Child][]} */
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
    ["Controller", html`<span><span class="lamp ${lamp}"></span>${word}</span>`],
    ["Left eye", eye(left, mirrors.left)],
    ["Right eye", eye(right, mirrors.right)],
    ["Vergence", verge],
    ["Round trip", `${millis(mirrors.rtt_p50_ms)} median, ${millis(mirrors.rtt_p99_ms)} p99`],
    ["Packets", `${count(mirrors.tx_packets)} out, ${count(mirrors.rx_packets)} in, ${count(mirrors.bad_packets)} bad`],
    ["Clock offset", mirrors.clock_offset_ms === null ? MISSING : `${number(mirrors.clock_offset_ms / 1000, 6)} s`],
  ];
}

/** @param {RigDocument} rig @param {ConsoleState["health"]} health @returns {[string, Child][]} */
function calibrationRows({ calibration, calibration_problem, steering }, health) {
  const calibrate = h("a", { href: wizardAddress("overview"), text: "Calibrate, check, records" });
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
  return html`<span><span class="lamp ${tone}"></span>${health ? `${word}: ${healthReason(health)}` : word}</span>`;
}

/** @param {string} caption @param {[string, Child][]} rows */
function pairs(caption, rows) {
  return html`<table class="status pairs">
    <caption>${caption}</caption>
    <tbody>
      ${rows.map(([name, value]) => html`<tr><th scope="row">${name}</th><td class="long">${value}</td></tr>`)}
    </tbody>
  </table>`;
}
