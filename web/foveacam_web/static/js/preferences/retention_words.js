// The words of a rule of retention.

/** @import { RetentionRule } from "#api" */

/** @param {RetentionRule} rule */
export function ruleWords({ keep_days, keep_gb }) {
  const parts = [keep_days !== null && `for ${keep_days} days`, keep_gb !== null && `the newest ${keep_gb} GB`].filter(
    Boolean,
  );
  return parts.length > 0 ? `kept ${parts.join(", ")}` : "kept for ever";
}
