// Look at a pixel of the wide view from Node 20 or newer: node fixate.mjs 720 540
const url = (process.env.FOVEACAM_URL ?? "http://127.0.0.1:8000").replace(/\/$/, "");
const token = process.env.FOVEACAM_TOKEN;
const authorization = token ? { Authorization: `Bearer ${token}` } : {};

/** Ask the server; a refusal is thrown in its own words. */
async function ask(path, { method = "GET", body, headers = {} } = {}) {
  const answer = await fetch(`${url}/api/v1${path}`, {
    method,
    headers: { ...authorization, "Content-Type": "application/json", ...headers },
    body: body && JSON.stringify(body),
  });
  if (!answer.ok) {
    const problem = await answer.json();
    throw new Error(`${problem.title}: ${problem.detail} ${problem.remedy ?? ""}`);
  }
  return answer.json();
}

/** Return the ended job; it is asked for once a second. */
async function ended(job) {
  while (job.ended_utc === null) {
    await new Promise((resolve) => setTimeout(resolve, 1000));
    job = await ask(`/jobs/${job.id}`);
  }
  if (job.problem) throw new Error(`${job.problem.title}: ${job.problem.detail}`);
  return job;
}

const [x_px, y_px] = process.argv.slice(2).map(Number);
const job = await ask("/fixations", {
  method: "POST",
  body: { pixel: { x_px, y_px } },
  headers: { "Idempotency-Key": crypto.randomUUID() },
});
const { result_url } = await ended(job);
const fixation = await ask(result_url.replace("/api/v1", ""));
console.log(JSON.stringify({ distance_m: fixation.distance_m, distance_sigma_m: fixation.distance_sigma_m }));
