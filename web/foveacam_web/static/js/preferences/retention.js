// The panel of retention on the settings page: its rules, what they would remove now, and the button.

import { outcome, request } from "../transport/api.js";
import { html, update } from "../elements/dom.js";
import { count, dayTime, sentence } from "../elements/format.js";
import { sizeWords } from "../capturing/gallery/dataset_words.js";
import { offers } from "../operating/session/words.js";
import { nothing, textButton } from "../elements/parts.js";
import { actWords, removedWords, ruleWords } from "./retention_words.js";

/**
 * @import { DueItem, RetentionApplied, RetentionPreview } from "#api"
 * @import { Commands, Store } from "#console"
 */

const MOST = 20;
/** @type {readonly [DueItem["kind"], string, string][]} */
const KINDS = [
  ["captures", "Datasets", "dataset"],
  ["recordings", "Recordings", "recording"],
  ["stills", "Stills", "still"],
  ["clouds", "Clouds", "cloud"],
  ["fixations", "Fixations", "fixation"],
  ["exports", "Exports of datasets", "export"],
];

/**
 * Show the rules in a place, and what is due.
 * @param {HTMLElement} place
 * @param {{store: Store, commands: Commands, signal: AbortSignal}} context
 */
export function showRetention(place, { store, commands, signal }) {
  const read = async () => {
    const { answer, error } = await outcome(/** @type {Promise<RetentionPreview>} */ (request("GET", "/retention")));
    if (signal.aborted) return;
    if (error) update(place, nothing(sentence(error.message)));
    else update(place, shown(answer, offers(store.state.sign_in, "administer") ? move : null));
  };
  const move = async (/** @type {string} */ digest) => {
    const moved = /** @type {RetentionApplied | null} */ (
      await commands.send("POST", "/retention", { body: { digest } })
    );
    if (moved)
      commands.notify({
        tone: "info",
        title: removedWords(moved.items),
        detail: moved.items.some(({ for_good }) => !for_good)
          ? "What is in the trash can be restored until it is emptied."
          : "",
      });
    await read();
  };
  void read();
}

/** @param {RetentionPreview} found @param {((digest: string) => unknown) | null} move null: who looks may not */
function shown({ file, rules, items, size_bytes, digest }, move) {
  return html`<div class="stack">
    <ul class="sentences">${KINDS.map(([kind, title]) => html`<li>${title}: ${ruleWords(rules[kind])}</li>`)}</ul>
    <p class="note">
      ${rules.automatic ? "Applied once an hour." : "Applied only here."} What has a label, or is in use, is kept always,
      and so are the newest cloud and fixation, and a fixation as long as it has a cloud. With a fixation goes its
      target. The rules are in${" "}<code>${file}</code>.
    </p>
    ${items.length === 0 ? nothing("Nothing would be removed now.") : dueOf(items)}
    <p class="actions">
      ${move && textButton(actWords(items), () => move(digest), { picture: "trash", disabled: items.length === 0 })}
      ${items.length > 0 && html`<span class="why">${count(items.length)}, ${sizeWords(size_bytes)}</span>`}
    </p>
  </div>`;
}

/** @param {DueItem[]} items */
function dueOf(items) {
  const more = items.length - MOST;
  return html`<ul class="named">
    ${items.slice(0, MOST).map(
      (item) => html`<li>
        <span><b>${item.name}</b>${" "}<span class="note">${dueWords(item)}</span></span>
      </li>`,
    )}
    ${more > 0 && html`<li><span class="note">… and ${count(more)} more</span></li>`}
  </ul>`;
}

/** @param {DueItem} item */
function dueWords({ kind, why, size_bytes, created_utc, for_good }) {
  const one = KINDS.find(([name]) => name === kind)?.[2];
  return `${one}, ${dayTime(created_utc)}, ${sizeWords(size_bytes)}: ${why}${for_good ? "; deleted for good" : ""}`;
}
