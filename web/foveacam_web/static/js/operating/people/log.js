// The log of who did what: searched, newest first, and as a file.

import { RequestError, request } from "../../transport/api.js";
import { h, html, update } from "../../elements/dom.js";
import { dayTime, MISSING } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { badge, choiceField, panel, textButton } from "../../elements/parts.js";
import { listingTable } from "./table.js";
import { OUTCOMES, OUTCOME_CHOICES, askerWords, auditPath, doingWords, requestWords } from "./words.js";
import { API } from "../../root.js";

/**
 * @import { AuditDocument, AuditPage, Problem } from "#api"
 * @import { PeopleContext } from "./page.js"
 * @typedef {{text: string, who: string, outcome: string}} Wanted the entries that are searched for
 */

/** @type {Wanted} */
const NOTHING = Object.freeze({ text: "", who: "", outcome: "" });
const AT_ONCE = 50;
const PAUSE_MS = 200; // pause in typing before a search
const COLUMNS = [
  { title: "When", kind: /** @type {const} */ ("when"), head: true },
  { title: "Who" },
  { title: "What", kind: /** @type {const} */ ("long") },
  { title: "Request", kind: /** @type {const} */ ("long") },
  { title: "Outcome" },
  { title: "From" },
];

/** @param {PeopleContext} context @returns {HTMLElement} */
export function openLog({ follow, signal }) {
  const [list, more] = [h("div", {}), h("div", {})];
  const log = new AuditLog();
  let wanted = NOTHING;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  signal.addEventListener("abort", () => clearTimeout(later));
  const search = (/** @type {Partial<Wanted>} */ part) => {
    wanted = { ...wanted, ...part };
    clearTimeout(later);
    later = setTimeout(() => void log.search(wanted), PAUSE_MS);
  };
  log.changed = () => {
    update(list, tableOf(log));
    update(more, log.next_before !== null && textButton("Show more", () => log.readMore()));
  };
  log.changed();
  follow(log);
  return h("div", { class: "stack" }, panel("Log", filters(search), list, more));
}

/** @param {(part: Partial<Wanted>) => void} search */
function filters(search) {
  const outcome = choiceField("Outcome", [["", "all"], ...OUTCOME_CHOICES], (value) => search({ outcome: value }));
  const typed = (/** @type {Event} */ { target }) => {
    const { name, value } = /** @type {HTMLInputElement} */ (target);
    search({ [name]: value });
  };
  return html`<div class="fields" role="search" aria-label="Search the log">
    <label class="field" @input=${typed}>
      <span>Search</span>
      <input type="search" name="text" maxlength="200" autocomplete="off" placeholder="Part of what was done" />
    </label>
    <label class="field" @input=${typed}>
      <span>Who</span>
      <input type="search" name="who" maxlength="60" autocomplete="off" placeholder="Everybody" />
    </label>
    ${outcome.element}
    <a class="plain" href="${API}/audit.jsonl" download>${icon("down")}Download all, JSON lines</a>
  </div>`;
}

/** @param {AuditLog} log */
function tableOf(log) {
  return listingTable(log, {
    label: "Log",
    empty: log.searched ? "No entry fits the search." : "Nothing has been done yet.",
    columns: COLUMNS,
    key: ({ id }) => String(id),
    cells: (entry) => {
      const { text, tone } = OUTCOMES[entry.outcome];
      return [
        html`<time datetime=${entry.utc} title=${entry.utc}>${dayTime(entry.utc)}</time>`,
        html`<span class="name">${askerWords(entry)}</span>`,
        doingWords(entry) || MISSING,
        html`<code>${requestWords(entry)}</code>`,
        badge(tone, text, `Status ${entry.status}`),
        entry.address,
      ];
    },
  });
}

/** The part of the log that is shown. */
class AuditLog {
  /** @type {AuditDocument[] | null} */
  rows = null;
  /** @type {Problem | null} */
  fault = null;
  refused = null;
  /** Where the older entries begin; null when there are none. @type {number | null} */
  next_before = null;
  /** Called when something of it has changed. */
  changed = () => {};
  #wanted = NOTHING;
  #asked = 0;

  /** Whether only some entries are wanted. */
  get searched() {
    return Object.values(this.#wanted).some((value) => value.trim() !== "");
  }

  /** @param {Wanted} wanted */
  search(wanted) {
    this.#wanted = wanted;
    return this.read();
  }

  /** Read the newest entries. */
  read() {
    return this.#ask(null);
  }

  /** Read the entries before those that are shown. */
  readMore() {
    return this.#ask(this.next_before);
  }

  /** @param {number | null} before */
  async #ask(before) {
    this.#asked += 1;
    const question = this.#asked;
    try {
      const path = auditPath({ ...this.#wanted, before, limit: AT_ONCE });
      const { entries, next_before } = /** @type {AuditPage} */ (await request("GET", path));
      if (question !== this.#asked) return;
      Object.assign(this, {
        rows: [...(before === null ? [] : (this.rows ?? [])), ...entries],
        next_before,
        fault: null,
      });
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      if (question !== this.#asked || error.document.status === 0) return; // a lost server is told elsewhere
      this.fault = error.document;
    }
    this.changed();
  }
}
