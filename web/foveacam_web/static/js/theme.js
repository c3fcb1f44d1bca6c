// Dark or light, before the first paint: loaded as a plain script in the head, so it must stay free of imports.

(() => {
  let theme = "system";
  try {
    theme = JSON.parse(localStorage.getItem("foveacam.settings") ?? "{}").theme ?? theme;
  } catch {
    // private mode or a damaged entry: the system's choice
  }
  if (theme !== "system") document.documentElement.dataset["theme"] = theme;
})();
