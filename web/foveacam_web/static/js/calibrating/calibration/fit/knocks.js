// Words the jumps of an eye's gaze that a fit found between the sweeps. Pure function.

import { pixels } from "../../../elements/format.js";

/**
 * Return a sentence about the jumps; empty when there were none.
 * @param {import("#api").FitDocument["drift"] | undefined} drift
 */
export function knockWords(drift) {
  const eyes = Object.entries(drift ?? {}).flatMap(([eye, { knocks_px: jumps }]) =>
    jumps?.length ? [`the ${eye} eye’s gaze jumped by ${jumps.map((jump) => pixels(jump)).join(", then by ")}`] : [],
  );
  return eyes.length
    ? `The rig was knocked during the sweeps: ${eyes.join("; ")}. This was corrected; the check shows whether that worked.`
    : "";
}
