// Chooses the backend that computes the depth of looks; links to the comparison of two.

import { COMPARE_ADDRESS } from "../addresses.js";
import { request } from "../transport/api.js";
import { fill, h } from "../elements/dom.js";
import { icon } from "../elements/icons.js";
import { backendWords, choiceWords } from "./depth_words.js";

/**
 * @import { DepthBackendsDocument } from "#api"
 * @import { Commands } from "#console"
 */

/** Return a list of the backends, with a button that confirms research use. @param {Commands} commands */
export function depthBackend(commands) {
  const select = h("select", { class: "tool depth-backend", "aria-label": "What computes the depth of a look" });
  const confirm = h("button", { class: "tool", type: "button", hidden: true });
  /** @param {DepthBackendsDocument} found */
  const show = (found) => {
    const options = found.backends.map((backend) => {
      const { name, problem } = backend;
      return h("option", {
        value: name,
        text: backendWords(backend),
        title: problem ?? "",
        disabled: problem !== null,
      });
    });
    fill(select, ...options);
    select.value = found.in_use;
    select.title = choiceWords(found);
    select.classList.toggle("warn", found.fallback !== null);
    confirm.hidden = true;
    research = new Set(found.backends.filter(({ research_only }) => research_only).map(({ name }) => name));
  };
  /** @type {Set<string>} */
  let research = new Set();
  const refresh = async () => show(/** @type {DepthBackendsDocument} */ (await request("GET", "/depth/backends")));
  /** @param {boolean} research_confirmed */
  const choose = async (research_confirmed) => {
    const body = { name: select.value, research_confirmed };
    await commands.send("PUT", "/depth/backend", { body });
    await refresh().catch(() => {});
  };
  select.addEventListener("focus", () => void refresh().catch(() => {})); // another viewer may have chosen
  select.addEventListener("change", () => {
    confirm.hidden = !research.has(select.value);
    confirm.textContent = `Use ${select.value} for research`;
    if (confirm.hidden) void choose(false);
  });
  confirm.addEventListener("click", () => void choose(true));
  void refresh().catch(() => {}); // the server is not there yet: asked again when it is opened
  const compare = h(
    "a",
    { class: "tool", href: COMPARE_ADDRESS, title: "Compare two", "aria-label": "Compare two" },
    icon("scales"),
  );
  return h("span", { class: "depth-backends" }, select, confirm, compare);
}
