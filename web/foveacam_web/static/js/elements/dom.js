// Builds and updates elements: templates of lit-html, and single elements that their module keeps and changes.

import { html as litHtml, nothing, render, svg as litSvg } from "../../vendor/lit-html/lit-html.js";

export { keyed } from "../../vendor/lit-html/directives/keyed.js";
export { repeat } from "../../vendor/lit-html/directives/repeat.js";

/** The value of an attribute that the element then does not have. */
export const absent = nothing;

const SVG = "http://www.w3.org/2000/svg";

/**
 * @import { TemplateResult } from "../../vendor/lit-html/lit-html.js"
 * @typedef {Node | TemplateResult | string | number | null | undefined | false} Child
 * @typedef {{
 *   class?: string, text?: string, on?: Record<string, (event: any) => void>, data?: Record<string, string>,
 *   [attribute: string]: unknown
 * }} Props `any`: each listener names its own event type
 */

/** The templates without their line breaks. @type {WeakMap<TemplateStringsArray, TemplateStringsArray>} */
const joined = new WeakMap();

/**
 * Remove the line breaks of a template with the spaces around them, as JSX does; between two words a space stays.
 * @param {TemplateStringsArray} strings
 * @returns {TemplateStringsArray} the same for the same template, as lit-html recognises it by identity
 */
function withoutBreaks(strings) {
  const known = joined.get(strings);
  if (known) return known;
  const cut = strings
    .join("\0")
    .replace(/<[^<>]*>|[^<>]+/g, (part) =>
      part.startsWith("<")
        ? part.replace(/\s*\n\s*/g, " ")
        : part.replace(
            /([^\s\0])?\s*\n\s*(?=([^\0])?)/g,
            (_, before, after) => (before ?? "") + (before && after ? " " : ""),
          ),
    )
    .split("\0");
  const result = /** @type {TemplateStringsArray} */ (Object.assign(cut, { raw: cut }));
  joined.set(strings, result);
  return result;
}

/** Replace `false` by null, which shows nothing, also in lists. @param {unknown} value @returns {unknown} */
function shown(value) {
  return Array.isArray(value) ? value.map(shown) : value === false ? null : value;
}

/**
 * Make a template of HTML; `cond && …` shows nothing where the condition is false.
 * @param {TemplateStringsArray} strings
 * @param {...unknown} values
 */
export function html(strings, ...values) {
  return litHtml(withoutBreaks(strings), ...values.map(shown));
}

/** Make a template of the inside of an SVG element. @param {TemplateStringsArray} strings @param {...unknown} values */
export function svg(strings, ...values) {
  return litSvg(withoutBreaks(strings), ...values.map(shown));
}

/**
 * Show templates in an element; what did not change keeps its elements. Where the focused element is gone, the keyboard
 * continues from `element`.
 * @param {HTMLElement} element
 * @param {unknown} content
 */
export function update(element, content) {
  const inside = element.contains(document.activeElement);
  render(shown(content), element);
  if (inside && !element.contains(document.activeElement)) focusOn(element);
}

/**
 * Make an HTML element.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Props} [props]
 * @param {...(Child | Child[])} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  dress(element, props, children);
  return element;
}

/**
 * Make an SVG element.
 * @template {keyof SVGElementTagNameMap} K
 * @param {K} tag
 * @param {Props} [props]
 * @param {...(Child | Child[])} children
 * @returns {SVGElementTagNameMap[K]}
 */
export function s(tag, props = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  dress(element, props, children);
  return element;
}

/** @param {Element} element @param {Props} props @param {(Child | Child[])[]} children */
function dress(element, props, children) {
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (name === "on") listen(element, /** @type {Record<string, (event: any) => void>} */ (value));
    else if (name === "data") Object.assign(/** @type {HTMLElement} */ (element).dataset, value);
    else if (name === "text") element.textContent = String(value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.flat().filter(isShown).map(asNode));
}

/** @param {Element} element @param {Record<string, (event: any) => void>} listeners */
function listen(element, listeners) {
  for (const [event, listener] of Object.entries(listeners)) element.addEventListener(event, listener);
}

/** @param {Child} child @returns {child is Node | TemplateResult | string | number} */
function isShown(child) {
  return child !== null && child !== undefined && child !== false;
}

/** @param {Node | TemplateResult | string | number} child */
function asNode(child) {
  if (typeof child !== "object") return String(child);
  if (child instanceof Node) return child;
  const fragment = document.createDocumentFragment();
  render(child, fragment);
  return fragment;
}

/** Replace the children of an element. @param {Element} element @param {...(Child | Child[])} children */
export function fill(element, ...children) {
  element.replaceChildren(...children.flat().filter(isShown).map(asNode));
}

/**
 * Return a function that shows a value in an element and builds it again only when the value has changed, so that
 * elements within, which are not templates, stay.
 * @template T
 * @param {HTMLElement} element
 * @param {(value: T) => unknown} build
 * @returns {(value: T) => void}
 */
export function changing(element, build) {
  let last = "";
  return (value) => {
    const now = JSON.stringify(value) ?? "undefined";
    if (now === last) return;
    last = now;
    update(element, build(value));
  };
}

/**
 * Focus an element that is not focusable by itself, so that the keyboard continues from there.
 * @param {HTMLElement} element
 */
export function focusOn(element) {
  if (!element.hasAttribute("tabindex")) element.tabIndex = -1;
  element.focus({ preventScroll: true });
}

/**
 * Set an element's text only when it differs: a screen reader does not repeat it and the layout stays.
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Return the element of this id, which the page's HTML contains. @param {string} id @returns {HTMLElement} */
export function need(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element #${id}`);
  return element;
}
