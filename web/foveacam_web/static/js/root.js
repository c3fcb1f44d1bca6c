// Where the server lives: "" on a site of its own, "/foveacam" below https://lab.example/foveacam/. Addresses in the
// server's answers have no such path; it is added where they arrive.

/** Path before the server's own addresses, without a slash at its end. In a page and in a worker. */
export const ROOT = rootOf(import.meta.url);

/** Address of the REST interface. */
export const API = `${ROOT}/api/v1`;

/** Return the path before /static/ in a module's address; "" where no server has sent it. @param {string} module_url */
export function rootOf(module_url) {
  const { protocol, pathname } = new URL(module_url);
  return protocol.startsWith("http") ? pathname.slice(0, Math.max(0, pathname.lastIndexOf("/static/"))) : "";
}

/**
 * Return an answer's text as JSON, with the root before every address in it: fields named `url` or `…_url`.
 * @param {string} text
 * @param {string} [root]
 */
export function parsed(text, root = ROOT) {
  if (root === "") return JSON.parse(text);
  const isAddress = (/** @type {string} */ key, /** @type {unknown} */ value) =>
    /(^|_)url$/.test(key) && typeof value === "string" && /^\/(?!\/)/.test(value);
  return JSON.parse(text, (key, value) => (isAddress(key, value) ? root + value : value));
}
