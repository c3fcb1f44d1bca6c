// The page of a collection: its list of cards with search and trash, or one entry. datasets.js, recordings.js and
// stills.js say what differs.

import { nothing, textButton, toolButton } from "../../elements/parts.js";
import { h, html, repeat, update } from "../../elements/dom.js";
import { count, dayTime, sentence } from "../../elements/format.js";
import { icon } from "../../elements/icons.js";
import { sizeWords } from "./dataset_words.js";
import "./drawn.js";
import { galleryAddress } from "../../addresses.js";
import { offers } from "../../operating/session/words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { GalleryContext } from "./page.js"
 * @import { CollectionOrders } from "./collection_orders.js"
 * @import { EntryReader, ListReader } from "./collection_readers.js"
 * @typedef {{id: string, name: string, label: string, size_bytes: number, created_utc: string | null}} Entry
 * @typedef {{
 *   state: string, removed: boolean, busy?: string, blank: string, picture: string, facts: unknown, progress?: unknown,
 *   tick?: unknown
 * }} Card `busy`: why it cannot be removed now; `blank`: the text in place of a picture; `tick`: chooses it with others
 * @typedef {{one: string, many: string}} Noun
 */

const PAUSE_MS = 200; // pause in typing before a search
const MOST_FAULTS = 20;

/**
 * Build the list of a collection.
 * @template {Entry} T
 * @param {{
 *   noun: Noun, hint: string, orders: CollectionOrders<T>, reader: ListReader<T>, card: (entry: T) => Card,
 *   intro: () => unknown, above?: () => unknown, key?: (entry: T) => string
 * }} collection `hint`: what can be searched for; `intro`: what is shown where there is none; `above`: above the list
 * @param {GalleryContext} context
 */
export function openList(
  { noun, hint, orders, reader, card, intro, above = () => null, key },
  { store, follow, signal },
) {
  let [in_trash, asked] = [false, false];
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  signal.addEventListener("abort", () => clearTimeout(later));
  const search = (/** @type {{target: HTMLInputElement}} */ { target }) => {
    clearTimeout(later);
    later = setTimeout(() => void reader.search(target.value), PAUSE_MS);
  };
  const turn = (/** @type {boolean} */ open, sure = false) => {
    [in_trash, asked] = [open, sure];
    show();
  };
  const empty = () => {
    turn(true);
    void orders.empty();
  };
  const place = h("div", { class: `datasets ${noun.many}` });
  const keyOf = (/** @type {T} */ entry) => `${card(entry).removed} ${key ? key(entry) : entry.id}`;
  const show = () => {
    const shown = in_trash ? reader.trash : reader.list;
    const held = reader.trash?.length ?? 0;
    const bytes = shown?.reduce((sum, { size_bytes }) => sum + size_bytes, 0) ?? 0;
    const ask = asked && in_trash && held > 0;
    const id = `${noun.one}-search`;
    update(
      place,
      html`<div class="gallery-bar">
          <div class="search" ?hidden=${in_trash}>
            <label for=${id}>Search</label>
            <input type="search" id=${id} maxlength="200" placeholder=${hint} autocomplete="off" @input=${search} />
          </div>
          <p class="why found" role="status">${shown?.length ? summary(shown.length, bytes, noun) : ""}</p>
          <div class="actions trash">
            <span class="why" role="alert">${ask ? `Delete ${held === 1 ? `this ${noun.one}` : `these ${count(held)} ${noun.many}`} for good?` : ""}</span>
            ${textButton("Empty the trash", () => turn(true, true), {
              hidden: ask || !in_trash || held === 0 || !offers(store.state.sign_in, "administer"),
            })}
            ${textButton("Delete for good", empty, { kind: "plain danger", hidden: !ask })}
            ${textButton("Keep", () => turn(true), { hidden: !ask })}
            <button type="button" class="plain" aria-pressed=${String(in_trash)} @click=${() => turn(!in_trash)}>
              <span class="face">${icon(in_trash ? "back" : "trash")}</span>
              <span>${in_trash ? `Back to the ${noun.many}` : held > 0 ? `Trash (${count(held)})` : "Trash"}</span>
            </button>
          </div>
        </div>
        <div>${!in_trash && above()}${emptiness(shown)}</div>
        <ul class="cards">${repeat(shown ?? [], keyOf, (entry) => cardOf(entry, card(entry), noun, orders))}</ul>`,
    );
  };
  const emptiness = (/** @type {T[] | null} */ shown) => {
    if (shown === null) return waiting("Loading the list");
    if (shown.length > 0) return null;
    if (in_trash) return nothing("The trash is empty.");
    if (reader.searched) return nothing(`No ${noun.one} holds “${reader.searched}”.`);
    return [nothing(`No ${noun.one} yet.`), html`<p class="lead">${intro()}</p>`];
  };
  reader.changed = show;
  show();
  follow(reader);
  return place;
}

/** @param {number} length @param {number} bytes @param {Noun} noun */
function summary(length, bytes, noun) {
  return [`${count(length)} ${length === 1 ? noun.one : noun.many}`, bytes > 0 && sizeWords(bytes)]
    .filter(Boolean)
    .join(", ");
}

/**
 * @template {Entry} T
 * @param {T} entry
 * @param {Card} card
 * @param {Noun} noun
 * @param {CollectionOrders<T>} orders
 */
function cardOf(entry, { state, removed, busy = "", blank, picture, facts, progress, tick }, noun, orders) {
  const { id, name, label, created_utc } = entry;
  const why = removed ? "In the trash" : blank;
  const restore = () => void orders.restore(entry);
  const remove = () => void orders.remove(entry);
  return html`<li class="card" data-state=${state}>
    <div class="card-cover">
      ${why ? html`<p class="blank">${why}</p>` : html`<drawn-picture src=${picture} lazy width="320" height="240"></drawn-picture>`}
    </div>
    <h3>
      ${removed ? html`<span title=${name}>${name}</span>` : html`<a href=${galleryAddress(noun.many, id)} title=${name}>${name}</a>`}
    </h3>
    <div class="words">
      ${label !== "" && html`<p class="label">${label}</p>`}
      ${facts}
      <p class="when">${created_utc && html`<time datetime=${created_utc}>${dayTime(created_utc)}</time>`}</p>
    </div>
    <div class="far">${progress}</div>
    <div class="tools">
      ${!removed && tick}
      ${
        removed
          ? textButton("Restore", restore, { picture: "again", name: `Restore ${name}` })
          : toolButton(`Put ${name} in the trash`, "trash", remove, {
              title: busy || "Put it in the trash",
              disabled: busy !== "",
            })
      }
    </div>
  </li>`;
}

/**
 * Build the page of one entry.
 * @template {Entry} T
 * @param {{noun: Noun, reader: EntryReader<T>, page: (entry: T) => unknown}} what
 * @param {GalleryContext} context
 */
export function openEntry({ noun, reader, page }, { follow }) {
  const place = h("div", { class: "dataset" });
  update(place, waiting("Loading the list"));
  reader.changed = () => update(place, reader.entry ? page(reader.entry) : missing(reader.missing, noun));
  follow(reader);
  return place;
}

/** @param {string} why @param {Noun} noun */
function missing(why, { many }) {
  const list = html`<a href=${galleryAddress(many)}>To the ${many}</a>`;
  return [nothing(sentence(why)), html`<p class="lead">It may be in the trash. ${list}.</p>`];
}

/**
 * Show the head of an entry's page: name, state and buttons, with what is to be said about it.
 * @template {Entry} T
 * @param {T} entry
 * @param {{noun: Noun, orders: CollectionOrders<T>, word?: unknown, actions: unknown, busy?: string, far: unknown}} parts
 *   `busy`: why it cannot be removed now
 */
export function headOf(entry, { noun, orders, word, actions, busy = "", far }) {
  const list = galleryAddress(noun.many);
  const back = `Back to the ${noun.many}`;
  const remove = async () => {
    if (await orders.remove(entry)) location.hash = list;
  };
  return html`<header class="dataset-head">
    <div class="name">
      <a class="tool" href=${list} aria-label=${back} title=${back}>${icon("back")}</a>
      <h3 tabindex="-1">${entry.name}</h3>
      ${word}
    </div>
    <div class="actions">
      ${actions}
      ${textButton("Put in the trash", remove, {
        picture: "trash",
        title: busy || "It can be restored until the trash is emptied",
        disabled: busy !== "",
      })}
    </div>
    <div class="far">${far}</div>
  </header>`;
}

/**
 * Return a function that shows the button which checks every file, and the server's sentences.
 * @template {Entry} T
 * @param {CollectionOrders<T>} orders
 * @param {() => void} changed called when it has to be shown again
 */
export function makeCheck(orders, changed) {
  let reading = false;
  /** @type {{sound: boolean, faults: string[]} | null} */
  let checked = null;
  return (/** @type {T} */ { id, size_bytes }) => {
    const check = async () => {
      [reading, checked] = [true, null];
      changed();
      checked = await orders.check(id);
      reading = false;
      changed();
    };
    const words = size_bytes > 0 ? `Reading ${sizeWords(size_bytes)} …` : "Reading …";
    return html`<div class="stack">
      <p class="actions">
        ${textButton("Check every file", check, { picture: "check", disabled: reading })}
        <span class="why">${reading && words}</span>
      </p>
      <div class="stack" role="status">${checked && resultOf(checked)}</div>
    </div>`;
  };
}

/** @param {{sound: boolean, faults: string[]}} checked */
function resultOf({ sound, faults }) {
  if (sound)
    return html`<p class="state good">${icon("check")}Every file, size, hash and row is as it was written.</p>`;
  const one = "One thing is not as it was written:";
  const shown = faults.slice(0, MOST_FAULTS).map((text) => html`<li>${sentence(text)}</li>`);
  const more = faults.length - MOST_FAULTS;
  return html`<p class="state bad">
      ${icon("warn")}${faults.length === 1 ? one : `${count(faults.length)} things are not as they were written:`}
    </p>
    <ul class="sentences">${shown}${more > 0 && html`<li>… and ${count(more)} more.</li>`}</ul>`;
}
