// The button at each view of the console that opens it in a window of its own.

import { h } from "../../elements/dom.js";
import { icon } from "../../elements/icons.js";
import { SOURCES, windowAddress } from "./layout.js";

/**
 * @import { Source } from "#page"
 * @import { Views } from "../../video/views.js"
 */

const SIZE = "popup=yes,width=960,height=720";

/** Offer a window for each view of the console. @param {Views} views @param {HTMLElement} scene where that of the 3D view goes */
export function offerWindows(views, scene) {
  for (const source of SOURCES) {
    if (source === "scene") scene.append(opener(source, "3D"));
    else {
      const { tools, title } = views.pane(source);
      tools.append(opener(source, title.textContent ?? source));
    }
  }
}

/** @param {Source} source @param {string} title */
function opener(source, title) {
  return openAside(windowAddress(source), title);
}

/** Make the link that opens an address in a window of its own. @param {string} href @param {string} title of what it shows */
export function openAside(href, title) {
  const label = `Open ${title} in a window of its own`;
  const click = (/** @type {MouseEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return; // the browser's own ways to open it elsewhere
    event.preventDefault();
    window.open(href, "_blank", SIZE);
  };
  return h(
    "a",
    { class: "tool opener", href, target: "_blank", "aria-label": label, title: label, on: { click } },
    icon("aside"),
  );
}
