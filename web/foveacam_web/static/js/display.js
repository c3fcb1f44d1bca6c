// Starts the page that shows the calibration pattern at its true size, on any screen that opens it.

import { Bareness } from "./devices/display/bareness.js";
import { Link } from "./devices/display/link.js";
import { Sheet } from "./devices/display/sheet.js";
import { ScaleDialog } from "./devices/display/scale_dialog.js";
import { Scales, screenKey } from "./devices/display/scale.js";
import { h, html, need, update } from "./elements/dom.js";
import { icon } from "./elements/icons.js";
import { nameOf, scaleWords, shownWords, warningWords } from "./devices/display/words.js";

/** @import { PatternDocument } from "#api" */

const scales = new Scales();
const sheet = new Sheet(need("pattern"));
const bareness = new Bareness(document.documentElement);
/** @type {{shown: PatternDocument | null, online: boolean, why: string}} */
const state = { shown: null, online: false, why: "" };

const link = new Link({
  described: () => ({ name: nameOf(navigator.userAgent), ...pagePixels(), px_per_mm: scale() }),
  shows: (shown) => {
    state.shown = shown;
    void sheet.load(shown).then(show);
    show();
  },
  onState: (online, why) => {
    Object.assign(state, { online, why });
    show();
  },
});
const dialog = new ScaleDialog((px_per_mm) => {
  scales.put(screenKey(screen), px_per_mm);
  show();
  void link.register();
});
document.body.append(dialog.element);

const setSize = h("button", { type: "button", class: "plain", on: { click: () => dialog.open(scale()) } });
setSize.textContent = "Set the size";
const fullScreen = h(
  "button",
  { type: "button", class: "plain primary", on: { click: () => void bareness.begin() } },
  icon("expand"),
  "Full screen",
);

/** Return the scale of this screen in device pixels, null before it was set. */
function scale() {
  return scales.of(screenKey(screen));
}

function pagePixels() {
  return {
    width_px: Math.max(1, Math.round(innerWidth * devicePixelRatio)),
    height_px: Math.max(1, Math.round(innerHeight * devicePixelRatio)),
  };
}

/** Show the state; the pattern moves only when screen, scale or pattern change. */
function show() {
  const page = pagePixels();
  const px_per_mm = scale();
  sheet.place({ ...page, px_per_mm, ratio: devicePixelRatio });
  const warning = warningWords({ shown: state.shown, ...page, px_per_mm, zoom: visualViewport?.scale ?? 1 });
  const place = need("warning");
  place.hidden = warning === null;
  update(place, warning && html`${icon("warn")}<span>${warning}</span>`);
  update(
    need("bar"),
    html`<p class="words">
        <b>${shownWords(state.shown)}</b>
        <span>${scaleWords({ ...page, px_per_mm })}</span>
        <span role="status">${state.online ? "" : `No connection to the server${state.why}: it shows what it showed last.`}</span>
      </p>
      <p class="buttons">${setSize}${fullScreen}</p>`,
  );
}

addEventListener("resize", () => {
  show();
  void link.register();
});
visualViewport?.addEventListener("resize", show);
show();
link.begin();
