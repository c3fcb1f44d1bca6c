// Saves a file in the browser: what the page has made, or what the server sent.

const KEPT_MS = 60_000; // the browser may start saving late

/** Save a file in the browser. @param {Blob} content @param {string} name */
export function hand(content, name) {
  const address = URL.createObjectURL(content);
  const link = document.createElement("a");
  Object.assign(link, { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
}
