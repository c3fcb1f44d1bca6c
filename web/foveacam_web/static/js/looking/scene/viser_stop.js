// STOP on the 3D view's own page, which has none of the console's panels: a button above all that viser draws, and Space.

import { RequestError, request } from "../../transport/api.js";
import { ROOT } from "../../root.js";
import { clockTime } from "../../elements/format.js";
import { fill, h } from "../../elements/dom.js";
import { Keyboard } from "../../keys.js";

/** @import { StopAnswer } from "#api" */

// The page is viser's, with styles of its own: these stay on their elements.
const PLACE = {
  position: "fixed",
  inset: "12px auto auto 50%",
  transform: "translateX(-50%)",
  zIndex: "2147483647",
  display: "grid",
  justifyItems: "center",
  gap: "6px",
  font: "13px system-ui, sans-serif",
};
const BUTTON = {
  minWidth: "84px",
  minHeight: "44px",
  padding: "0 18px",
  border: "0",
  borderRadius: "6px",
  background: "#c6231b",
  color: "#fff",
  font: "700 16px system-ui, sans-serif",
  letterSpacing: "0.08em",
  cursor: "pointer",
};
const NOTE = {
  maxWidth: "min(90vw, 420px)",
  padding: "6px 12px",
  borderRadius: "6px",
  background: "#fde8e6",
  color: "#8c1c15",
};

const button = h("button", { id: "stop", type: "button", title: "Park the mirrors now (Space)" }, "STOP");
const note = h("div", { id: "stopped", role: "alert", hidden: true });
const place = h("div", {}, button, note);
Object.assign(place.style, PLACE);
Object.assign(button.style, BUTTON);
Object.assign(note.style, NOTE);
button.addEventListener("click", () => void stop());
new Keyboard({ stop: () => void stop(), escape: () => {}, letters: () => false, keys: {} });
document.body.append(place);

async function stop() {
  try {
    const { parked } = /** @type {StopAnswer} */ (
      await request("POST", "/stop", { patience_ms: 5000, keepalive: true })
    );
    say(parked ? "the mirrors are parked." : "the mirrors did not confirm; nothing moves them until it is released.");
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    show(`Not stopped from here: ${error.message}`);
  }
}

/** @param {string} words */
function say(words) {
  const console_link = h("a", { href: `${ROOT}/`, target: "_blank" }, "Release it in the console");
  show(`Stopped at ${clockTime(new Date().toISOString())}: ${words} `, console_link, ".");
}

/** @param {(string | Node)[]} parts */
function show(...parts) {
  fill(note, ...parts);
  note.hidden = false;
}
