// Sets the dark or light theme before the first paint. Loaded as a plain script in the head, so it must have no
// imports.

(() => {
  let theme = "system";
  try {
    theme = JSON.parse(localStorage.getItem("foveacam.settings") ?? "{}").theme ?? theme;
  } catch {
    // private mode or a damaged entry: use the system's theme
  }
  if (theme !== "system") document.documentElement.dataset["theme"] = theme;
})();
