// Keeps STOP in reach while a dialog is open. No part of the first load: what opens dialogs comes later.

import { h } from "../elements/dom.js";

/**
 * Keep a button usable while dialogs are open: a modal one makes all of the page inert that is not in it, so that the
 * button moves into the topmost, and stays at its place on the screen.
 * @param {HTMLElement} button
 */
export function keepOnTop(button) {
  const gap = h("span", { class: "stop stop-gap", "aria-hidden": "true" }); // placed as the button is
  /** @type {Element[]} the open dialogs, the topmost last */
  let open = [];
  const place = () => {
    const top = open.at(-1);
    if (top ? button.parentElement === top : !gap.isConnected) return;
    if (!top) {
      button.removeAttribute("style");
      gap.replaceWith(button);
      return;
    }
    if (!gap.isConnected) {
      const { width, height } = button.getBoundingClientRect();
      Object.assign(gap.style, { width: `${width}px`, height: `${height}px` });
      button.replaceWith(gap);
    }
    top.append(button);
    align();
  };
  const align = () => {
    if (!gap.isConnected) return;
    const { left, top, width, height } = gap.getBoundingClientRect();
    Object.assign(button.style, {
      position: "fixed",
      inset: `${top}px auto auto ${left}px`,
      width: `${width}px`,
      height: `${height}px`,
      minWidth: "0",
      minHeight: "0",
    });
  };
  new MutationObserver(() => {
    const now = [...document.querySelectorAll("dialog:modal")];
    open = [...open.filter((each) => now.includes(each)), ...now.filter((each) => !open.includes(each))];
    place();
  }).observe(document.body, { subtree: true, childList: true, attributeFilter: ["open"] });
  window.addEventListener("resize", align);
}
