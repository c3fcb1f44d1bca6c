// Builds the settings page: of this browser, of all viewers, and what the server keeps by name.

import { ENGINE_ADDRESS, PEOPLE_ADDRESS, RIG_ADDRESS, SETUP_ADDRESS } from "../addresses.js";
import { fill, h, html, update } from "../elements/dom.js";
import { clockTime, number } from "../elements/format.js";
import { icon } from "../elements/icons.js";
import { pageHead } from "../pages.js";
import { settingRows } from "../panels/dialogs.js";
import { nothing, panel, textButton, toolButton } from "../elements/parts.js";
import { recordOptions } from "../capturing/recording/options.js";
import { anaglyphColours } from "../video/anaglyph_colours.js";
import { showRetention } from "./retention.js";
import { lastLayout } from "../operating/windows/last_layout.js";
import { layoutAddress } from "../operating/windows/layout.js";

/**
 * @import { CameraPreset, WindowLayout } from "#api"
 * @import { Commands, Store } from "#console"
 * @import { Preferences } from "./reader.js"
 */

/** @param {HTMLElement} place @param {{store: Store, commands: Commands, preferences: Preferences}} context */
export function mountSettingsPage(place, { store, commands, preferences }) {
  const [cameras, layouts, rig] = [h("div", { class: "stack" }), h("div", { class: "stack" }), h("div", {})];
  const [recordings, retention] = [h("div", {}), h("div", {})];
  let shown = new AbortController();
  const colours = anaglyphColours(commands);
  fill(
    place,
    pageHead("settings-title", "Settings"),
    html`<div class="settings-body">
      ${panel("This browser", h("div", { class: "settings" }, settingRows(store)))}
      <div class="column">
        ${panel("All viewers", h("label", { class: "setting" }, "Anaglyph: left and right glass", colours))}
        ${panel("Recordings", recordings)} ${panel("Retention", retention)} ${panel("Rig", rig)}
      </div>
      <div class="column">${panel("Cameras by name", cameras)} ${panel("Windows by name", layouts)}</div>
    </div>`,
  );
  store.on(["camera_presets", "settings_page"], ({ camera_presets, settings_page }) => {
    if (settings_page) update(cameras, camerasOf(camera_presets, preferences));
  });
  store.on(["window_layouts", "settings_page"], ({ window_layouts, settings_page }) => {
    if (settings_page) update(layouts, layoutsOf(window_layouts, preferences));
  });
  store.on(["settings_page"], ({ settings_page }) => {
    shown.abort();
    shown = new AbortController();
    fill(recordings, settings_page && recordOptions({ store, signal: shown.signal }));
    if (settings_page) showRetention(retention, { store, commands, signal: shown.signal });
  });
  update(
    rig,
    html`<p class="lead">
      Markers as printed, baseline, limits, settle time and cameras are the rig's own:
      ${" "}<a href=${SETUP_ADDRESS}>set up the rig</a>. Exposure, gain and rate are set on the page
      ${" "}<a href=${RIG_ADDRESS}>Rig</a>. Who may use the server stands under
      ${" "}<a href=${PEOPLE_ADDRESS}>People and rights</a>, and whether
      the server keeps up with its work under <a href=${ENGINE_ADDRESS}>Engine</a>.
    </p>`,
  );
}

/** @param {CameraPreset[] | null} presets @param {Preferences} preferences */
function camerasOf(presets, preferences) {
  return [
    html`<p class="lead">Exposure, gain, black level, rate and format of all cameras, as they are now.</p>`,
    nameForm("Save the cameras as", (name) => preferences.saveCameras(name)),
    presets?.length === 0 && nothing("None is saved yet."),
    html`<ul class="named">${(presets ?? []).map(
      ({ name, saved_utc, cameras }) => html`<li>
        <span><b>${name}</b> <span class="note">${words(cameras)}, ${clockTime(saved_utc)}</span></span>
        ${textButton("Apply", () => preferences.applyCameras(name))}
        ${deleter(name, () => preferences.deleteCameras(name))}
      </li>`,
    )}</ul>`,
  ];
}

/** @param {CameraPreset["cameras"]} cameras */
function words(cameras) {
  return cameras.map(({ role, exposure_ms }) => `${role} ${number(exposure_ms, 2)} ms`).join(", ");
}

/** @param {WindowLayout[] | null} layouts @param {Preferences} preferences */
function layoutsOf(layouts, preferences) {
  const last = lastLayout();
  return [
    html`<p class="lead">A window with views, divided as the last one in this browser.</p>`,
    last
      ? nameForm("Save the last window as", (name) => preferences.saveLayout(name, last))
      : nothing("Open a view in a window of its own, and divide it; then it can be saved here."),
    html`<ul class="named">${(layouts ?? []).map(
      ({ name, layout }) => html`<li>
        <span><b>${name}</b></span>
        <a class="plain" href=${layoutAddress(layout)} target="_blank" rel="noopener">${icon("aside")}Open</a>
        ${deleter(name, () => preferences.deleteLayout(name))}
      </li>`,
    )}</ul>`,
  ];
}

/** @param {string} name @param {() => unknown} act */
function deleter(name, act) {
  return toolButton(`Delete ${name}`, "trash", () => act(), { title: "Delete" });
}

/** @param {string} label @param {(name: string) => unknown} act */
function nameForm(label, act) {
  const send = (/** @type {SubmitEvent & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const input = /** @type {HTMLInputElement} */ (event.currentTarget.elements.namedItem("name"));
    void act(input.value.trim());
    input.value = "";
  };
  return html`<form class="actions" @submit=${send}>
    <label class="field"><span>${label}</span
      ><input type="text" name="name" required maxlength="80" pattern="[^\\/]*\\S[^\\/]*" autocomplete="off" />
    </label>
    <button type="submit" class="plain">Save</button>
  </form>`;
}
