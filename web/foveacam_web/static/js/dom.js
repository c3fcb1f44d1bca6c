// Builds and updates elements. The page has no framework; every module uses these functions.

const SVG = "http://www.w3.org/2000/svg";

/**
 * @typedef {Node | string | number | null | undefined | false} Child
 * @typedef {{
 *   class?: string, text?: string, on?: Record<string, (event: any) => void>, data?: Record<string, string>,
 *   [attribute: string]: unknown
 * }} Props `any`: each listener names its own event type
 */

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

/**
 * @param {Element} element
 * @param {Props} props
 * @param {(Child | Child[])[]} children
 */
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

/**
 * @param {Element} element
 * @param {Record<string, (event: any) => void>} listeners
 */
function listen(element, listeners) {
  for (const [event, listener] of Object.entries(listeners)) element.addEventListener(event, listener);
}

/**
 * @param {Child} child
 * @returns {child is Node | string | number}
 */
function isShown(child) {
  return child !== null && child !== undefined && child !== false;
}

/** @param {Node | string | number} child */
function asNode(child) {
  return child instanceof Node ? child : String(child);
}

/**
 * Replace the children of an element.
 * @param {Element} element
 * @param {...(Child | Child[])} children
 */
export function fill(element, ...children) {
  element.replaceChildren(...children.flat().filter(isShown).map(asNode));
}

/**
 * Return a function that shows a value in an element and rebuilds it only when the value has changed, so that focus,
 * scrolling and pictures stay. The focused child gets the focus again by its `data-keep`.
 * @template T
 * @param {HTMLElement} element
 * @param {(value: T) => Child[]} build
 * @returns {(value: T) => void}
 */
export function changing(element, build) {
  let last = "";
  return (value) => {
    const now = JSON.stringify(value) ?? "undefined";
    if (now === last) return;
    last = now;
    const focused = document.activeElement;
    const inside = focused instanceof HTMLElement && element.contains(focused);
    const keep = inside ? focused.dataset["keep"] : undefined;
    fill(element, ...build(value));
    if (!inside) return;
    const again = keep === undefined ? null : element.querySelector(`[data-keep="${CSS.escape(keep)}"]`);
    if (again instanceof HTMLElement) again.focus();
    else focusOn(element);
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
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * Return the element of this id, which the page's HTML contains.
 * @param {string} id
 * @returns {HTMLElement}
 */
export function need(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element #${id}`);
  return element;
}
