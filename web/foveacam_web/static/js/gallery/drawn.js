// Shows a picture that the server draws, or the reason why it cannot.

import { file, RequestError } from "../api.js";
import { h, say } from "../dom.js";
import { sentence } from "../format.js";

const ROOT = "/api/v1";

/**
 * @param {{lazy?: boolean, width?: number, height?: number}} [options] the size that is reserved for it, px
 * @returns {{element: HTMLElement, image: HTMLImageElement, show: (url: string, alt: string) => void}}
 */
export function makeDrawn({ lazy = false, width, height } = {}) {
  const image = h("img", {
    alt: "",
    loading: lazy ? "lazy" : "eager",
    decoding: "async",
    width,
    height,
    draggable: "false",
  });
  const reason = h("p", { class: "no-picture", hidden: true });
  const element = h("div", { class: "drawn" }, image, reason);
  const settle = (/** @type {string} */ why) => {
    image.hidden = why !== "";
    reason.hidden = why === "";
    say(reason, why);
    element.removeAttribute("aria-busy");
  };
  let wanted = "";
  image.addEventListener("load", () => settle(""));
  image.addEventListener("error", () => {
    const failed = wanted;
    void whyNot(failed).then((why) => failed === wanted && settle(why));
  });
  const show = (/** @type {string} */ url, /** @type {string} */ alt) => {
    image.alt = alt;
    if (url === wanted) return;
    wanted = url;
    image.hidden = false;
    reason.hidden = true;
    element.setAttribute("aria-busy", "true");
    image.src = url;
  };
  return { element, image, show };
}

/**
 * Return the server's reason for a picture that did not load.
 * @param {string} url
 */
async function whyNot(url) {
  try {
    await file(url.slice(ROOT.length));
    return "This picture could not be shown.";
  } catch (error) {
    if (error instanceof RequestError) return sentence(error.message);
    throw error;
  }
}
