// Lists the sessions, one for each calibration: open one, create one, combine several, delete one.

import { changing, fill, h, html, repeat, setText } from "../../elements/dom.js";
import { dayTime, MISSING, number } from "../../elements/format.js";
import { badge, keptButton, nothing, textButton, toolButton } from "../../elements/parts.js";
import { offers } from "../../operating/session/words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { SessionSummary } from "#page"
 * @import { WizardContext } from "./page.js"
 * @typedef {{list: SessionSummary[], open: string | undefined}} Shown
 */

/** Build the choice of the session that the wizard shows. @param {WizardContext} context */
export function makeSessionChoice({ store, orders, reader }) {
  const select = h("select", { id: "session", on: { change: () => void reader.openSession(select.value) } });
  const add = textButton("New", () => orders.newSession(), {
    picture: "plus",
    title: "Begin another measurement; this one is kept",
  });
  const empty = h("span", { class: "why" });
  const show = changing(select, (/** @type {Shown} */ { list, open }) =>
    list.map(({ id, label }) => html`<option value=${id} .selected=${id === open}>${label || id}</option>`),
  );
  store.on(["sessions", "session"], ({ sessions, session }) => {
    show({ list: sessions ?? [], open: session?.id });
    select.value = session?.id ?? "";
    select.title = session?.label ?? "";
    select.hidden = !sessions?.length;
    setText(empty, sessions?.length === 0 ? "Nothing measured yet" : "");
  });
  return html`<div class="session-choice"><label for="session">Measurement</label>${select}${empty}${add}</div>`;
}

/** @param {HTMLElement} place @param {WizardContext} context */
export function mountSessions(place, { store, orders, reader }) {
  const list = h("ul", { class: "records sessions" });
  const empty = h("div", {});
  /** @type {string | null} */
  let asked = null;
  /** @type {Set<string>} */
  const picked = new Set();
  const hint = h("span", { class: "why", role: "status" });
  const combine = keptButton("Combine", () => act(), { picture: "plus" });
  const together = h("p", { class: "actions" }, html`<span class="starter">${combine}${hint}</span>`);
  const act = async () => {
    combine.disabled = true;
    setText(hint, "Putting them together …");
    const made = await orders.combine([...picked]);
    if (made) picked.clear();
    update();
  };
  const choose = () => {
    combine.disabled = picked.size < 2;
    setText(hint, picked.size < 2 ? "Tick two or more to fit their sweeps as one." : "");
  };
  const pick = (/** @type {string} */ id, /** @type {boolean} */ on) => {
    if (on) picked.add(id);
    else picked.delete(id);
    update();
  };
  const ask = (/** @type {string | null} */ id) => {
    asked = id;
    update();
  };
  const show = changing(list, (/** @type {Shown & {asked: string | null, picked: string[]}} */ now) =>
    repeat(
      now.list,
      ({ id }) => id,
      (session) =>
        html`<li class=${session.id === now.open ? "current" : ""}>
        ${now.list.length > 1 && tickOf(session, now.picked.includes(session.id), pick)}
        <div class="what">
          <p class="name">
            <strong title=${session.label}>${session.label || session.id}</strong>
            ${session.id === now.open && badge("plain", "open")}
            ${session.running && badge("good", "running")}
          </p>
          <p class="legend">
            <time datetime=${session.created_utc}>
              ${dayTime(session.created_utc)}
            </time>
            <span class="number">${size(session.bytes)}</span>
          </p>
        </div>
        <div class="links">
          ${
            now.asked === session.id
              ? [
                  html`<span class="why" role="alert">Delete all that it measured?</span>`,
                  textButton("Delete", () => orders.deleteSession(session.id), { kind: "plain danger" }),
                  textButton("Keep", () => ask(null)),
                ]
              : [
                  session.id !== now.open &&
                    textButton("Open", () => reader.openSession(session.id), { name: `Open ${session.label}` }),
                  offers(store.state.sign_in, "administer") &&
                    toolButton(`Delete ${session.label}`, "trash", () => ask(session.id), {
                      title: session.running ? "Not while something runs in it" : "Delete",
                      disabled: Boolean(session.running),
                    }),
                ]
          }
        </div>
      </li>`,
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
        ? waiting("Loading the measurements")
        : sessions.length === 0
          ? nothing("Nothing measured yet. Calibrate everything, or begin with step 1.")
          : null,
    );
  };
  fill(place, empty, list, together);
  store.on(["sessions", "session"], update);
}

/** @param {SessionSummary} session @param {boolean} ticked @param {(id: string, on: boolean) => void} pick */
function tickOf({ id, label }, ticked, pick) {
  return html`<input
    type="checkbox" aria-label="Combine ${label}" .checked=${ticked}
    @change=${(/** @type {{target: HTMLInputElement}} */ { target }) => pick(id, target.checked)}
  />`;
}

/** @param {number | null} bytes */
function size(bytes) {
  if (bytes === null) return MISSING;
  return bytes < 1e6 ? `${number(bytes / 1e3, 0)} kB` : `${number(bytes / 1e6, 1)} MB`;
}
