// Downloads what the page has made as a file.

/** Download a file in the browser. @param {Blob} content @param {string} name */
export function hand(content, name) {
  const address = URL.createObjectURL(content);
  const link = document.createElement("a");
  Object.assign(link, { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
