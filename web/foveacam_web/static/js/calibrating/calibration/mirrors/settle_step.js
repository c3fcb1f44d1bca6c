// Shows how the mirrors settle: the time to one pixel and to one percent, the resonance and its quality; sets how long
// the rig waits after every move.

import { changing, h, html } from "../../../elements/dom.js";
import { dayTime, MISSING, number } from "../../../elements/format.js";
import { figures, nothing, panel, starter } from "../../../elements/parts.js";
import { figure, picturesOf } from "../pictures.js";

/**
 * @import { PictureDocument, SettleAxisDocument, SettleTimeDocument } from "#api"
 * @import { ConsoleState } from "#page"
 * @import { WizardContext } from "../page.js"
 */

/** @param {WizardContext} context */
export function makeSettleStep({ store, orders }) {
  const live = h("div", { class: "live-slot" });
  const table = h("div", { class: "scroll-x" });
  const diagrams = h("div", { class: "diagrams" });
  const showTable = changing(table, tableOf);
  const showDiagrams = changing(diagrams, (/** @type {PictureDocument[]} */ pictures) =>
    pictures.length
      ? pictures.map(figure)
      : [nothing("How each axis came to rest is drawn here once it was measured.")],
  );
  store.on(["session"], ({ session }) => {
    showTable(session?.settle?.axes ?? []);
    showDiagrams(picturesOf(session, ["settle"]));
  });
  const start = starter({
    label: "Characterise",
    store,
    act: () => orders.run("settle"),
    primary: true,
    keys: ["session"],
    named: ({ session }) => (session?.settle ? "Characterise again" : "Characterise"),
  });
  const element = h(
    "div",
    { class: "step step-settle" },
    html`<div class="seeing">
      <div class="column">
        ${panel(
          "Settle times",
          html`<p class="lead">
            Each axis makes a step, and the fovea takes pictures at growing delays after it; their distance from the
            last one shows how the mirror settles. The trigger’s timing and the raster follow from it.
          </p>`,
          html`<p class="remedy">
            Point both eyes at a textured object that stands still. The pictures are dark meanwhile: short exposures
            freeze the motion.
          </p>`,
          html`<p class="actions">${start}</p>`,
          table,
        )}
        ${panel("Wait after a move", makeWait({ store, orders }))}
      </div>
      ${live}
    </div>`,
    panel("Diagram", diagrams),
  );
  return { element, live };
}

/**
 * Build the panel of the settle time: the value in use, its source, and the alternatives.
 * @param {Pick<WizardContext, "store" | "orders">} context
 */
function makeWait({ store, orders }) {
  const now = h("div", {});
  const show = changing(now, waitOf);
  const keys = /** @type {(keyof ConsoleState)[]} */ (["session", "settle_time", "sessions"]);
  const apply = starter({
    label: "Use what was measured",
    store,
    keys,
    act: () => orders.applySettleTime(),
    why: ({ session, settle_time }) =>
      session?.settle?.settle_us == null
        ? "Not measured in this session."
        : isOfSession({ session, settle_time })
          ? "In use already."
          : null,
    named: ({ session }) =>
      session?.settle?.settle_us == null
        ? "Use what was measured"
        : `Use the measured ${milliseconds(session.settle.settle_us)}`,
  });
  const forget = starter({
    label: "Use the rig file’s",
    store,
    keys,
    act: () => orders.forgetSettleTime(),
    why: ({ settle_time }) =>
      settle_time?.measured ? null : settle_time ? "In use already." : "The rig is not open yet.",
    named: ({ settle_time }) =>
      settle_time ? `Use the rig file’s ${milliseconds(settle_time.rig_file_us)}` : "Use the rig file’s",
  });
  store.on(keys, ({ session, settle_time, sessions }) =>
    show({
      settle_time,
      here: session?.id === settle_time?.measured?.session_id,
      label: sessions?.find(({ id }) => id === settle_time?.measured?.session_id)?.label ?? "",
    }),
  );
  const lead = html`<p class="lead">
    The rig waits this long after every move before it looks. A measured value is the time of the largest move on the
    slowest axis; it then applies now and at every start.
  </p>`;
  return html`<div class="stack">${lead}${now}<p class="actions">${apply}${forget}</p></div>`;
}

/**
 * Return whether the settle time in use is the one that the open session has measured.
 * @param {Pick<ConsoleState, "session" | "settle_time">} state
 */
function isOfSession({ session, settle_time }) {
  const measured = settle_time?.measured;
  return (
    Boolean(session && measured) &&
    measured?.session_id === session?.id &&
    measured?.settle_us === session?.settle?.settle_us
  );
}

/** @param {{settle_time: SettleTimeDocument | null, here: boolean, label: string}} now */
function waitOf({ settle_time, here, label }) {
  if (!settle_time) return [nothing("Not known before the rig is open.")];
  const { settle_us, measured, rig_file_us } = settle_time;
  const session = here ? "in this session" : label ? `in “${label}”` : "in a session that is gone";
  const from = measured ? `measured ${dayTime(measured.measured_utc)} ${session}` : "the rig file, not measured";
  return [
    figures([
      ["In use", milliseconds(settle_us)],
      ["Known from", from],
      ["Rig file", milliseconds(rig_file_us)],
    ]),
  ];
}

/** @param {number} settle_us */
function milliseconds(settle_us) {
  return `${number(settle_us / 1000, 1)} ms`;
}

/** @param {SettleAxisDocument[]} axes */
function tableOf(axes) {
  if (axes.length === 0) return [nothing("Not measured yet.")];
  const value = (/** @type {number | null} */ number_, /** @type {number} */ decimals, /** @type {string} */ unit) =>
    number_ === null ? MISSING : `${number(number_, decimals)}${unit}`;
  return [
    html`<table class="compare">
      <thead>
        <tr>${["Axis", "to 1 px", "to 1 %", "Resonance", "Q"].map((text) => html`<th scope="col">${text}</th>`)}</tr>
      </thead>
      <tbody>
        ${axes.map(
          (axis) =>
            html`<tr>
            <th scope="row" class="eye-${axis.eye}">${axis.eye} ${axis.axis}</th>
            <td>${value(axis.settle_ms, 2, " ms")}</td>
            <td>${value(axis.settle_1pct_ms, 2, " ms")}</td>
            <td>${value(axis.resonance_hz, 0, " Hz")}</td>
            <td>${value(axis.quality, 1, "")}</td>
          </tr>`,
        )}
      </tbody>
    </table>`,
  ];
}

/** @param {ConsoleState} state */
export function settleProgress({ session }) {
  const slowest_ms = Math.max(...(session?.settle?.axes ?? []).map(({ settle_ms }) => settle_ms ?? 0));
  return Number.isFinite(slowest_ms) ? { tone: "good", text: `${number(slowest_ms, 1)} ms` } : null;
}
