// Lists the sessions, one for each calibration: open one, create one, combine several, delete one.

import { changing, fill, h, say } from "../dom.js";
import { MISSING, number } from "../format.js";
import { icon } from "../icons.js";
import { badge, nothing } from "./parts.js";

/**
 * @import { SessionSummary } from "#page"
 * @import { WizardContext } from "./page.js"
 * @typedef {{list: SessionSummary[], open: string | undefined}} Shown
 */

/**
 * Build the choice of the session that the wizard shows.
 * @param {WizardContext} context
 */
export function makeSessionChoice({ store, orders, reader }) {
  const select = h("select", { id: "session", on: { change: () => void reader.openSession(select.value) } });
  const add = h(
    "button",
    {
      type: "button",
      class: "plain",
      title: "Begin another measurement; this one is kept",
      on: { click: () => void orders.newSession() },
    },
    icon("plus"),
    "New",
  );
  const empty = h("span", { class: "why" });
  const show = changing(select, (/** @type {Shown} */ { list, open }) =>
    list.map(({ id, label }) => h("option", { value: id, text: label || id, selected: id === open })),
  );
  store.on(["sessions", "session"], ({ sessions, session }) => {
    show({ list: sessions ?? [], open: session?.id });
    select.value = session?.id ?? "";
    select.title = session?.label ?? "";
    select.hidden = !sessions?.length;
    say(empty, sessions?.length === 0 ? "Nothing measured yet" : "");
  });
  return h("div", { class: "session-choice" }, h("label", { for: "session", text: "Measurement" }), select, empty, add);
}

/**
 * @param {HTMLElement} place
 * @param {WizardContext} context
 */
export function mountSessions(place, { store, orders, reader }) {
  const list = h("ul", { class: "records sessions" });
  const empty = h("div", {});
  /** @type {string | null} */
  let asked = null;
  /** @type {Set<string>} */
  const picked = new Set();
  const hint = h("span", { class: "why", role: "status" });
  const combine = h(
    "button",
    { type: "button", class: "plain", on: { click: () => void act() } },
    icon("plus"),
    "Combine",
  );
  const together = h("p", { class: "actions" }, h("span", { class: "starter" }, combine, hint));
  const act = async () => {
    combine.disabled = true;
    say(hint, "Putting them together …");
    const made = await orders.combine([...picked]);
    if (made) picked.clear();
    update();
  };
  const choose = () => {
    combine.disabled = picked.size < 2;
    say(hint, picked.size < 2 ? "Tick two or more to fit their sweeps as one." : "");
  };
  const ask = (/** @type {string | null} */ id) => {
    asked = id;
    update();
  };
  const show = changing(list, (/** @type {Shown & {asked: string | null, picked: string[]}} */ now) =>
    now.list.map((session) =>
      h(
        "li",
        { class: session.id === now.open ? "current" : "" },
        now.list.length > 1 && makeTick(session, picked, choose),
        h(
          "div",
          { class: "what" },
          h(
            "p",
            { class: "name" },
            h("strong", { text: session.label || session.id, title: session.label }),
            session.id === now.open && badge("plain", "open"),
            session.running && badge("good", "running"),
          ),
          h(
            "p",
            { class: "legend" },
            h("time", {
              datetime: session.created_utc,
              text: new Date(session.created_utc).toLocaleString(undefined, {
                dateStyle: "medium",
                timeStyle: "short",
              }),
            }),
            h("span", { class: "number", text: size(session.bytes) }),
          ),
        ),
        h(
          "div",
          { class: "links" },
          now.asked === session.id
            ? [
                h("span", { class: "why", role: "alert", text: "Delete all that it measured?" }),
                h(
                  "button",
                  {
                    type: "button",
                    class: "plain danger",
                    data: { keep: `delete-${session.id}` },
                    on: { click: () => void orders.deleteSession(session.id) },
                  },
                  "Delete",
                ),
                h("button", { type: "button", class: "plain", on: { click: () => ask(null) } }, "Keep"),
              ]
            : [
                session.id !== now.open &&
                  h(
                    "button",
                    {
                      type: "button",
                      class: "plain",
                      data: { keep: `open-${session.id}` },
                      "aria-label": `Open ${session.label}`,
                      on: { click: () => void reader.openSession(session.id) },
                    },
                    "Open",
                  ),
                h(
                  "button",
                  {
                    type: "button",
                    class: "tool",
                    data: { keep: `delete-${session.id}` },
                    "aria-label": `Delete ${session.label}`,
                    title: session.running ? "Not while something runs in it" : "Delete",
                    disabled: Boolean(session.running),
                    on: { click: () => ask(session.id) },
                  },
                  icon("trash"),
                ),
              ],
        ),
      ),
    ),
  );
  const update = () => {
    const { sessions, session } = store.state;
    for (const id of picked) if (!sessions?.some((known) => known.id === id)) picked.delete(id);
    show({ list: sessions ?? [], open: session?.id, asked, picked: [...picked] });
    together.hidden = (sessions?.length ?? 0) < 2;
    choose();
    fill(
      empty,
      sessions === null
        ? nothing("Loading …")
        : sessions.length === 0
          ? nothing("Nothing measured yet. Calibrate everything, or begin with step 1.")
          : null,
    );
  };
  fill(place, empty, list, together);
  store.on(["sessions", "session"], update);
}

/**
 * @param {SessionSummary} session
 * @param {Set<string>} picked
 * @param {() => void} choose
 */
function makeTick({ id, label }, picked, choose) {
  const tick = h("input", {
    type: "checkbox",
    "aria-label": `Combine ${label}`,
    data: { keep: `tick-${id}` },
    checked: picked.has(id),
    on: {
      change: () => {
        if (tick.checked) picked.add(id);
        else picked.delete(id);
        choose();
      },
    },
  });
  return tick;
}

/** @param {number | null} bytes */
function size(bytes) {
  if (bytes === null) return MISSING;
  return bytes < 1e6 ? `${number(bytes / 1e3, 0)} kB` : `${number(bytes / 1e6, 1)} MB`;
}
