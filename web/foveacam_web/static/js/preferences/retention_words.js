// Texts of the retention rules and of what they remove.

import { count } from "../elements/format.js";

/** @import { DueItem, RetentionRule } from "#api" */

/** @param {RetentionRule} rule */
export function ruleWords({ keep_days, keep_gb }) {
  const parts = [keep_days !== null && `for ${keep_days} days`, keep_gb !== null && `the newest ${keep_gb} GB`].filter(
    Boolean,
  );
  return parts.length > 0 ? `kept ${parts.join(", ")}` : "kept for ever";
}

/** The words of the button that removes what is due. @param {Pick<DueItem, "for_good">[]} items */
export function actWords(items) {
  const for_good = items.filter((item) => item.for_good).length;
  if (for_good === 0) return "Move to the trash";
  return for_good === items.length ? "Delete for good" : `Remove, ${count(for_good)} of them for good`;
}

/** The words of what was removed. @param {Pick<DueItem, "for_good">[]} items */
export function removedWords(items) {
  const for_good = items.filter((item) => item.for_good).length;
  const moved = items.length - for_good;
  const parts = [
    moved > 0 && `${count(moved)} moved to the trash`,
    for_good > 0 && `${count(for_good)} deleted for good`,
  ];
  return parts.filter(Boolean).join(", ") || "Nothing was removed";
}
