// Parts that the gallery's lists share: the search field, the trash buttons, cards that keep their elements.

import { fill, h, say } from "../dom.js";
import { count } from "../format.js";
import { icon } from "../icons.js";

/**
 * @import { Trash } from "./trash.js"
 * @typedef {{one: string, many: string}} Noun
 */

const PAUSE_MS = 200; // pause in typing before a search

/**
 * @param {{id: string, placeholder: string, search: (text: string) => void, signal: AbortSignal}} context
 */
export function makeSearch({ id, placeholder, search, signal }) {
  const input = h("input", { type: "search", id, maxlength: 200, placeholder, autocomplete: "off" });
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let later;
  input.addEventListener("input", () => {
    clearTimeout(later);
    later = setTimeout(() => search(input.value), PAUSE_MS);
  });
  signal.addEventListener("abort", () => clearTimeout(later));
  return h("div", { class: "search" }, h("label", { for: id, text: "Search" }), input);
}

/**
 * Build the button that shows the trash, and the one that empties it after a confirmation.
 * @param {{noun: Noun, trash: Trash, turn: (open: boolean) => void}} context
 */
export function makeTrashDoor({ noun, trash, turn }) {
  let now = { open: false, held: 0, asked: false };
  const ask = (/** @type {boolean} */ asked) => show({ ...now, asked });
  const button = (/** @type {string} */ name, /** @type {() => void} */ act, /** @type {string} */ more = "") =>
    h("button", { type: "button", class: `plain ${more}`, on: { click: act } }, name);
  const [question, face, words] = [
    h("span", { class: "why", role: "alert" }),
    h("span", { class: "face" }),
    h("span", {}),
  ];
  const empty = button("Empty the trash", () => ask(true));
  const sure = button(
    "Delete for good",
    () => {
      ask(false);
      void trash.empty();
    },
    "danger",
  );
  const keep = button("Keep", () => ask(false));
  const door = h("button", { type: "button", class: "plain", on: { click: () => turn(!now.open) } }, face, words);
  // The elements stay, so that no click is lost when the number changes.
  const show = (/** @type {typeof now} */ next) => {
    now = { ...next, asked: next.asked && next.open && next.held > 0 };
    const { open, held, asked } = now;
    say(
      question,
      asked ? `Delete ${held === 1 ? `this ${noun.one}` : `these ${count(held)} ${noun.many}`} for good?` : "",
    );
    empty.hidden = asked || !open || held === 0;
    for (const each of [sure, keep]) each.hidden = !asked;
    if (face.dataset["open"] !== String(open)) fill(face, icon(open ? "back" : "trash"));
    face.dataset["open"] = String(open);
    say(words, open ? `Back to the ${noun.many}` : held > 0 ? `Trash (${count(held)})` : "Trash");
    door.setAttribute("aria-pressed", String(open));
  };
  const element = h("div", { class: "actions trash" }, question, empty, sure, keep, door);
  return {
    element,
    show: (/** @type {boolean} */ open, /** @type {number} */ held) => show({ open, held, asked: now.asked }),
  };
}

/**
 * Show cards in a list; those that stay keep their elements, so that no click is lost.
 * @template T
 * @param {HTMLElement} list
 * @param {{key: (shown: T) => string, make: () => {element: HTMLElement, show: (shown: T) => void}}} context
 */
export function cardsIn(list, { key, make }) {
  /** @type {Map<string, ReturnType<typeof make>>} */
  let cards = new Map();
  return (/** @type {T[]} */ shown) => {
    const known = cards;
    cards = new Map(shown.map((each) => [key(each), known.get(key(each)) ?? make()]));
    for (const each of shown) cards.get(key(each))?.show(each);
    if ([...known.keys()].join("\n") === [...cards.keys()].join("\n")) return;
    const focused = document.activeElement;
    fill(list, ...[...cards.values()].map(({ element }) => element));
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus({ preventScroll: true });
  };
}
