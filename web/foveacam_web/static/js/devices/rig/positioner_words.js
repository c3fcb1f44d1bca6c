// Texts about the position of a pan-tilt or a rail, and the next step while it is not known.

/**
 * @typedef {{connected: boolean, moving: boolean, homed: boolean, awaits_zero: boolean}} Positioner
 */

/** @param {Positioner} now @param {string} moving */
export function stateWord(now, moving) {
  if (!now.connected) return "not connected";
  if (now.moving) return moving;
  if (now.homed) return "at rest";
  return now.awaits_zero ? "waits for its zero" : "not homed";
}

/** @param {Positioner | null} now @param {string} verb */
export function nextStep(now, verb) {
  if (!now?.connected || now.moving || now.homed) return "";
  return now.awaits_zero
    ? `Bring it to its zero, then confirm that: it is not known where it ${verb}.`
    : `Home it first: it is not known where it ${verb}.`;
}
