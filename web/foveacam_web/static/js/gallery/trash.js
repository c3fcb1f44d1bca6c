// Moves datasets, recordings and stills to the trash, restores them, and empties the trash.

import { request } from "../api.js";

/**
 * @import { Commands } from "../commands.js"
 * @typedef {{id: string, name: string}} Named
 */

const UNDO_MS = 15_000;

/** The trash of one resource. */
export class Trash {
  #commands;
  #resource;
  #changed;

  /**
   * @param {{commands: Commands, resource: string, changed: () => unknown}} context
   *   `resource`: its path below /api/v1; `changed`: called after each command that has changed the list
   */
  constructor({ commands, resource, changed }) {
    this.#commands = commands;
    this.#resource = resource;
    this.#changed = changed;
  }

  /**
   * @param {Named} what
   * @param {string} [became] the text of the message, after the name
   * @returns {Promise<boolean>}
   */
  async remove({ id, name }, became = "is in the trash") {
    const gone = await this.#commands.attempt(() => request("DELETE", this.#path(id)).then(() => true));
    if (gone)
      this.#commands.say({
        tone: "info",
        title: `“${name}” ${became}`,
        detail: "",
        stay_ms: UNDO_MS,
        action: { label: "Undo", act: () => this.restore({ id, name }) },
      });
    this.#changed();
    return gone === true;
  }

  /** @param {Named} what */
  async restore({ id, name }) {
    const back = await this.#commands.attempt(
      () => /** @type {Promise<Named>} */ (request("POST", `${this.#path(id)}/restore`)),
    );
    if (back && back.name !== name)
      this.#commands.say({
        tone: "info",
        title: `Restored as “${back.name}”`,
        detail: `There is another “${name}” by now.`,
      });
    this.#changed();
  }

  /** Delete everything in the trash for good. */
  async empty() {
    await this.#commands.attempt(() => request("DELETE", `${this.#resource}/trash`));
    this.#changed();
  }

  /** @param {string} id */
  #path(id) {
    return `${this.#resource}/${encodeURIComponent(id)}`;
  }
}
