// Chooses the colours of the anaglyph, for all viewers.

import { request } from "../transport/api.js";
import { h } from "../elements/dom.js";

/**
 * @import { AnaglyphColours } from "#api"
 * @import { Commands } from "#console"
 */

/** The left and the right glass. @type {readonly [AnaglyphColours["style"], string][]} */
export const STYLES = [
  ["red_cyan", "Red, cyan"],
  ["red_blue", "Red, blue"],
  ["cyan_red", "Cyan, red"],
  ["blue_red", "Blue, red"],
];
const ADDRESS = "/views/anaglyph/style";

/** Return a select with the colours in force. @param {Commands} commands */
export function anaglyphColours(commands) {
  const select = h(
    "select",
    {
      class: "tool anaglyph-style",
      "aria-label": "Colours of the left and the right glass",
      title: "Colours of the left and the right glass, for all viewers",
    },
    STYLES.map(([value, text]) => h("option", { value, text })),
  );
  const show = async () => {
    const found = /** @type {AnaglyphColours} */ (await request("GET", ADDRESS));
    select.value = found.style;
  };
  select.addEventListener("focus", () => void show().catch(() => {})); // another viewer may have chosen
  select.addEventListener("change", () => void commands.send("PUT", ADDRESS, { body: { style: select.value } }));
  void show().catch(() => {}); // the server is not there yet: asked again when it is opened
  return select;
}
