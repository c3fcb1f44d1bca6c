// Builds the set-up page: devices, roles, values, the rig file, the steps of the start.

import { file } from "../../transport/api.js";
import { fill, h, html, update } from "../../elements/dom.js";
import { pageHead } from "../../pages.js";
import { panel, textButton } from "../../elements/parts.js";
import { camerasOf, Pictures, rolesOf } from "./devices.js";
import { filesOf, reviewOf } from "./review.js";
import { startList } from "./start.js";
import { valuesOf } from "./values.js";
import { waiting } from "../../elements/waiting.js";

/**
 * @import { FoundCameraDocument } from "#api"
 * @import { ConsoleState, Store } from "#console"
 * @import { SetupOrders } from "./orders.js"
 * @import { SetupReader } from "./reader.js"
 */

/** @param {HTMLElement} place @param {{store: Store, orders: SetupOrders, reader: SetupReader}} context */
export function mountSetupPage(place, { store, orders, reader }) {
  const body = h("div", { class: "setup-body" });
  fill(
    place,
    pageHead("setup-title", "Set up a rig", html`<span class="lead">Nothing is changed before it is saved.</span>`),
    body,
  );
  const show = () => store.state.setup_page && update(body, bodyOf(store.state));
  const pictures = new Pictures({ take: takePicture, changed: show });
  const search = () => {
    pictures.forget();
    void reader.search();
  };
  const bodyOf = (/** @type {ConsoleState} */ state) => {
    if (state.setup_problem) return [html`<p class="note bad" role="alert">${state.setup_problem}</p>`];
    if (!state.setup) return [waiting("Loading the rig file")];
    return [
      html`<div class="setup-main">
        ${panel("Rig file", filesOf(state, orders))}
        ${panel(
          "Cameras",
          rolesOf(state, orders),
          html`<div class="actions">
            ${textButton("Search again", search, { disabled: state.searching })}
            ${state.searching && html`<span class="why" role="status"><span class="spinner" aria-hidden="true"></span> Every bus is searched …</span>`}
          </div>`,
          camerasOf(state, orders, pictures),
        )}
        ${valuesOf(state, orders)}
      </div>`,
      html`<div class="setup-side">
        ${panel("Review and save", reviewOf(state, orders))} ${panel("Start of the rig that is open", startList(state.start))}
      </div>`,
    ];
  };
  store.on(
    [
      "setup_page",
      "setup",
      "setup_file",
      "setup_files",
      "setup_problem",
      "found",
      "searching",
      "advice",
      "tries",
      "start",
      "stream",
    ],
    show,
  );
}

/** @param {FoundCameraDocument} camera */
async function takePicture({ kind, name }) {
  const { content } = await file(`/rig/setup/picture.jpg?${new URLSearchParams({ kind, name })}`);
  return content;
}
