// The found cameras with their pictures, and the camera of each role.

import { badge, nothing, textButton, toolButton } from "../../elements/parts.js";
import { html, keyed, repeat } from "../../elements/dom.js";
import { sentence } from "../../elements/format.js";
import { CAMERAS } from "../rig/words.js";
import { chooser, notesBeside } from "./fields.js";
import { busName, cameraChoices, cameraOf, keyOf, roleIn, ROLES, TRIGGERS, withRole, withValue } from "./words.js";

/**
 * @import { FoundCameraDocument, RigDraft } from "#api"
 * @import { ConsoleState, Role } from "#page"
 * @import { SetupOrders } from "./orders.js"
 */

/** Build the choice of each role's camera. @param {ConsoleState} state @param {SetupOrders} orders */
export function rolesOf(state, orders) {
  const { setup, found } = state;
  if (!setup) return null;
  return html`<div class="setup-roles">
    ${ROLES.map((role) => {
      const chosen = setup.draft.cameras[role] ?? null;
      return html`<div class="field role-${role}">
        ${chooser({
          id: `setup-role-${role}`,
          label: CAMERAS[role],
          choices: cameraChoices(found, chosen),
          value: chosen ? keyOf(chosen) : "",
          change: (key) => orders.change((draft) => withValue(draft, `cameras.${role}`, cameraOf(key))),
        })}
        ${notesBeside(`cameras.${role}`, state)}
      </div>`;
    })}
    ${!setup.simulated && triggerOf(setup.draft, state, orders)}
  </div>`;
}

/** Build the choice of what starts the foveae's exposures. @param {RigDraft} draft @param {ConsoleState} state @param {SetupOrders} orders */
function triggerOf(draft, state, orders) {
  return html`<div class="field" title="One pulse of the mirrors' controller exposes both foveae when their mirrors rest">
    ${chooser({
      id: "setup-fovea_trigger",
      label: "Left and right expose",
      choices: TRIGGERS,
      value: draft.fovea_trigger,
      change: (trigger) => orders.change((now) => withValue(now, "fovea_trigger", trigger)),
    })}
    ${notesBeside("fovea_trigger", state)}
  </div>`;
}

/**
 * @param {ConsoleState} state
 * @param {SetupOrders} orders
 * @param {Pictures} pictures
 */
export function camerasOf(state, orders, pictures) {
  const { setup, found, searching } = state;
  if (!setup || !found) return searching ? nothing("Every bus is searched …") : null;
  const silent = found.silent.map(
    ({ kind, problem }) =>
      html`<li><b>${busName(/** @type {FoundCameraDocument["kind"]} */ (kind))}</b> ${sentence(problem)}</li>`,
  );
  return [
    found.cameras.length === 0
      ? nothing("No camera was found. Plug one in, then search again.")
      : html`<ul class="setup-cameras">
          ${repeat(found.cameras, keyOf, (camera) => cardOf(camera, setup.draft, orders, pictures))}
        </ul>`,
    silent.length > 0 &&
      html`<details class="more"><summary>Buses that cannot be searched here</summary><ul class="silent">${silent}</ul></details>`,
    notesBeside("cameras", state),
  ];
}

/** @param {FoundCameraDocument} camera @param {RigDraft} draft @param {SetupOrders} orders @param {Pictures} pictures */
function cardOf(camera, draft, orders, pictures) {
  const given = roleIn(draft, camera);
  const chip = (/** @type {Role} */ role) =>
    textButton(role, () => orders.change((now) => withRole(now, camera, given === role ? null : role)), {
      kind: "chip",
      pressed: given === role,
    });
  return html`<li class="setup-camera" data-camera=${keyOf(camera)}>
    ${pictureOf(camera, pictures)}
    <p class="who">
      <strong>${[camera.vendor, camera.model].filter(Boolean).join(" ") || "camera"}</strong>
      <span class="number">serial ${camera.serial} · ${busName(camera.kind)}${camera.address && ` · ${camera.address}`}</span>
    </p>
    <p class="state">
      ${camera.role && badge("good", `open as ${camera.role}`)}
      ${!camera.role && camera.in_use && html`<span class="note bad">${sentence(camera.in_use)}</span>`}
      ${camera.problem && html`<span class="note bad">${sentence(camera.problem)}</span>`}
    </p>
    <div class="chips" role="group" aria-label=${`Role of ${camera.serial}`}>${ROLES.map(chip)}</div>
  </li>`;
}

/** @param {FoundCameraDocument} camera @param {Pictures} pictures */
function pictureOf(camera, pictures) {
  const { address, problem } = pictures.of(camera);
  const again = toolButton(`New picture of ${camera.serial}`, "again", () => pictures.renew(camera), {
    title: "New picture",
  });
  return html`<div class="picture">
    ${address && keyed(address, html`<img src=${address} alt=${`Picture of ${camera.serial}`} />`)}
    ${problem && html`<p class="note warn">${sentence(problem)}</p>`}
    ${!address && !problem && html`<p class="note">Picture comes …</p>`}
    ${again}
  </div>`;
}

/** The pictures of found cameras, taken one after the other. */
export class Pictures {
  /** @type {Map<string, {address: string, problem: string}>} */
  #known = new Map();
  /** @type {Promise<unknown>} */
  #queue = Promise.resolve();
  #changed;
  #take;

  /**
   * @param {{take: (camera: FoundCameraDocument) => Promise<Blob>, changed: () => void}} context
   */
  constructor({ take, changed }) {
    this.#take = take;
    this.#changed = changed;
  }

  /** @param {FoundCameraDocument} camera */
  of(camera) {
    const known = this.#known.get(keyOf(camera));
    if (known) return known;
    this.renew(camera);
    return { address: "", problem: "" };
  }

  /** @param {FoundCameraDocument} camera */
  renew(camera) {
    const key = keyOf(camera);
    const before = this.#known.get(key);
    this.#known.set(key, { address: before?.address ?? "", problem: "" });
    this.#queue = this.#queue.then(async () => {
      let now = { address: "", problem: "" };
      try {
        now = { address: URL.createObjectURL(await this.#take(camera)), problem: "" };
      } catch (error) {
        now = { address: "", problem: error instanceof Error ? error.message : "no picture" };
      }
      if (before?.address) URL.revokeObjectURL(before.address);
      this.#known.set(key, now);
      this.#changed();
    });
  }

  /** Forget all pictures, so that they are taken again the next time they are shown. */
  forget() {
    for (const { address } of this.#known.values()) URL.revokeObjectURL(address);
    this.#known.clear();
  }
}
