// Shows the mirrors' controller: its identity, whether it is enabled and guarded, its link, its clock; restarts
// mirrors that do not move.

import { figures, nothing, starter } from "../../elements/parts.js";
import { changing, fill, h, html } from "../../elements/dom.js";
import { count, MISSING, millis, number, sentence, span } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";

/**
 * @import { ControllerLinkDocument, MirrorsDocument, PositionStreamDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { RigOrders } from "./orders.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: RigOrders}} context */
export function mountController(place, { store, orders }) {
  const [state, line] = [h("div", { class: "stack" }), h("div", { class: "stack" })];
  fill(place, state, switches(store, orders), line);
  const showState = changing(state, stateOf);
  const showLine = changing(line, (/** @type {ControllerLinkDocument | null} */ link) => (link ? lineOf(link) : []));
  store.on(["rig", "rig_page"], ({ rig, rig_page }) => {
    if (!rig_page) return;
    showState(
      rig?.mirrors
        ? {
            mirrors: { ...rig.mirrors, link: null },
            remedy: rig.problems.find(({ device }) => /mirror|controller/.test(device))?.remedy ?? "",
          }
        : null,
    );
    showLine(rig?.mirrors?.link ?? null);
  });
}

/** @param {{mirrors: MirrorsDocument, remedy: string} | null} now */
function stateOf(now) {
  if (!now) return [nothing("The controller is not known yet: the rig is opening.")];
  const { connected, enabled, fault, guarded, rail_wanted, controller } = now.mirrors;
  const [tone, word] =
    fault || !connected
      ? ["bad", connected ? "Fault" : "Not connected"]
      : enabled
        ? ["good", "Connected, mirrors on"]
        : ["warn", rail_wanted === false ? "Connected, switched off by the operator" : "Connected, mirrors off"];
  return [
    html`<p class="state ${tone}">${tone === "good" ? icon("check") : icon("warn")}${word}</p>`,
    fault && html`<p class="lead">${sentence(fault)}</p>`,
    now.remedy && !fault?.includes(now.remedy) && html`<p class="remedy">${sentence(now.remedy)}</p>`,
    controller &&
      figures([
        ["Controller", nameOf(controller)],
        ["Firmware", controller.version],
        ["Serial", controller.serial],
        ["Port", controller.port || MISSING],
      ]),
    html`<p class="guard">
      <span class="lamp ${guarded ? "good" : ""}"></span>
      ${
        guarded
          ? "The guardian watches: should this server be killed, it parks the mirrors and switches them off."
          : "No guardian watches: should this server be killed, the mirrors stay where they are."
      }
    </p>`,
  ];
}

/** @param {import("#api").DeviceInfoDocument} info */
function nameOf({ vendor, model }) {
  return model.startsWith(vendor) ? model : `${vendor} ${model}`;
}

/** @param {Store} store @param {RigOrders} orders */
function switches(store, orders) {
  const away = (/** @type {ConsoleState} */ { rig }) =>
    rig?.mirrors?.connected ? null : "The controller is not connected.";
  const on = starter({
    label: "Switch on",
    store,
    act: () => orders.enable(true),
    keys: ["rig", "stop"],
    silent: true,
    why: (state) => away(state) ?? (state.rig?.mirrors?.enabled ? "They are on." : null),
  });
  const off = starter({
    label: "Switch off",
    store,
    act: () => orders.enable(false),
    keys: ["rig"],
    silent: true,
    why: (state) => away(state) ?? (state.rig?.mirrors?.enabled ? null : "They are off."),
  });
  const recover = starter({
    label: "Recover mirrors",
    store,
    act: () => orders.recover(),
    keys: ["rig"],
    picture: "again",
    silent: true,
    why: away,
  });
  return html`<div class="stack">
    <div class="actions">${on}${off}${recover}</div>
    <p class="aside-note">
      Recover mirrors: for a mirror that does not follow its commands. Both DACs are restarted without switching the
      high voltage, then both mirrors return to their commanded position. Needs firmware 2.1 or newer.
    </p>
  </div>`;
}

/** Show the traffic of the line, the clock and the streams of positions. @param {ControllerLinkDocument} link */
export function lineOf(link) {
  const drift = link.clock_drift_ppm === null ? "not measured yet" : `${number(link.clock_drift_ppm, 2)} ppm`;
  return [
    html`<h4>Line</h4>`,
    html`<table class="compare">
      <thead><tr>${["", "Sent", "Received"].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
      <tbody>
        ${pair("Packets/s", number(link.tx_packets_per_s, 1), number(link.rx_packets_per_s, 1))}
        ${pair("Bytes/s", number(link.tx_bytes_per_s, 0), number(link.rx_bytes_per_s, 0))}
        ${pair("Packets", count(link.tx_packets), count(link.rx_packets))}
        ${pair("Bytes", count(link.tx_bytes), count(link.rx_bytes))}
      </tbody>
    </table>`,
    figures([
      ["Queue", `${count(link.queued_bytes)} bytes`],
      [
        "Round trip",
        `${millis(link.rtt_p50_ms)} median, ${millis(link.rtt_p95_ms)} p95, ${millis(link.rtt_max_ms)} longest`,
      ],
      ["Broken packets", count(link.bad_packets)],
      ["CRC errors", link.crc ? count(link.crc_errors) : "no CRC in use"],
      ["Lost answers", count(link.lost_answers)],
      ["Updates given", `${number(link.update_limit_hz, 0)} Hz at most`],
    ]),
    html`<h4>Clock</h4>`,
    figures([
      ["Ahead of ours", offset(link.clock_offset_ms)],
      ["Drifts", drift],
    ]),
    ...streams(link.streams),
  ];
}

/** @param {string} name @param {string} sent @param {string} received */
function pair(name, sent, received) {
  return html`<tr><th scope="row">${name}</th><td>${sent}</td><td>${received}</td></tr>`;
}

/** @param {number} offset_ms */
function offset(offset_ms) {
  return Math.abs(offset_ms) < 10_000
    ? `${number(offset_ms, 3)} ms`
    : `${number(offset_ms / 1000, 3)} s (${span(Math.abs(offset_ms) / 1000)})`;
}

/** @param {PositionStreamDocument[]} found */
function streams(found) {
  if (found.length === 0) return [];
  const volts = (/** @type {number} */ x, /** @type {number} */ y) =>
    Number.isFinite(x) ? `${number(x, 2)}, ${number(y, 2)} V` : MISSING;
  return [
    html`<h4>Streams</h4>`,
    html`<div class="scroll-x">
      <table class="compare">
        <thead><tr>${["", "Updates", "Left", "Right"].map((text) => html`<th scope="col">${text}</th>`)}</tr></thead>
        <tbody>
          ${found.map(
            (stream) =>
              html`<tr>
              <th scope="row">${String(stream.stream)}</th>
              <td>${number(stream.updates_per_s, 1)} Hz</td>
              <td class="eye-left">${volts(stream.left_x_v, stream.left_y_v)}</td>
              <td class="eye-right">${volts(stream.right_x_v, stream.right_y_v)}</td>
            </tr>`,
          )}
        </tbody>
      </table>
    </div>`,
  ];
}
