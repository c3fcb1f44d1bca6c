// Builds the tables of the page of people; on a phone each row is a card.

import { h, html, repeat, update } from "../../elements/dom.js";
import { dayTime } from "../../elements/format.js";
import { nothing } from "../../elements/parts.js";
import { refusal } from "../session/form.js";
import { agoWords } from "./words.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { Listing } from "./listing.js"
 * @typedef {{title: string, kind?: "when" | "long" | "acts", head?: boolean}} Column `head`: the cell that names the row
 */

/**
 * Show a list as a table.
 * @template T
 * @param {Pick<Listing<T>, "rows" | "fault" | "refused">} listing
 * @param {{label: string, empty: string, columns: Column[], key: (row: T) => string, cells: (row: T) => unknown[]}} how
 *   `empty`: what is said where there is none; `cells`: one for each column
 */
export function listingTable({ rows, fault, refused }, { label, empty, columns, key, cells }) {
  if (fault) return refusal(fault);
  if (rows === null) return waiting("Loading the people");
  if (rows.length === 0) return nothing(empty);
  return html`<div class="scroll-x">
    <table class="listing" aria-label=${label}>
      <thead>
        <tr>${columns.map(({ title }) => html`<th scope="col">${title}</th>`)}</tr>
      </thead>
      ${repeat(rows, key, (row) => {
        const problem = refused?.at === key(row) ? refused.problem : null;
        return html`<tbody>
          <tr>${cells(row).map((cell, index) => cellOf(cell, columns[index]))}</tr>
          ${problem && html`<tr><td class="row-refused" colspan=${columns.length}>${refusal(problem)}</td></tr>`}
        </tbody>`;
      })}
    </table>
  </div>`;
}

/**
 * Build the table of a list that the page follows.
 * @template T
 * @param {Listing<T>} listing
 * @param {(listing: Listing<T>) => void} follow
 * @param {Parameters<typeof listingTable<T>>[1]} how
 */
export function followedTable(listing, follow, how) {
  const place = h("div", {});
  listing.changed = () => update(place, listingTable(listing, how));
  listing.changed();
  follow(listing);
  return place;
}

/** @param {unknown} cell @param {Column | undefined} column */
function cellOf(cell, { title, kind, head } = { title: "" }) {
  if (head) return html`<th scope="row" class=${kind ?? ""}>${cell}</th>`;
  return html`<td class=${kind ?? ""} data-title=${title}><div class="cell">${cell}</div></td>`;
}

/** Show how long ago something was, with its date and time. @param {string | null} utc */
export function ago(utc) {
  return utc === null ? "never" : html`<time datetime=${utc} title=${dayTime(utc)}>${agoWords(utc, Date.now())}</time>`;
}
