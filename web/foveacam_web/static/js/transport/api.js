// Sends REST requests. Every failure is a RequestError that carries the server's problem document: asked, found,
// remedy.

import { signIn } from "./sign_in.js";
import { API, parsed } from "../root.js";

/** @import { Problem, SignInDocument } from "#api" */

const PATIENCE_MS = 15_000;
const SIGN_IN_PATH = "/session";
const STOP_PATH = "/stop";
/** Problem type of a request without a valid sign-in; a wrong password has another one. */
export const SIGNED_OUT = "unauthorized";

/** A request that failed; `document` is the server's problem, or one made here when the server did not answer. */
export class RequestError extends Error {
  /** @param {Problem} document */
  constructor(document) {
    super(document.detail || document.title);
    this.document = document;
  }

  get slug() {
    return this.document.type.split("/").pop() ?? "";
  }
}

/**
 * @typedef {{body?: unknown, headers?: Record<string, string>, patience_ms?: number, keepalive?: boolean}} Options
 */

/**
 * Send a request and return the parsed JSON, or null where the response has no body. The path is below /api/v1.
 * @template T
 * @param {"GET" | "POST" | "PUT" | "PATCH" | "DELETE"} method
 * @param {string} path
 * @param {Options} [options]
 * @returns {Promise<T>}
 */
export async function request(method, path, options = {}) {
  const response = await answerTo(method, path, options);
  if (response.status === 204) return /** @type {T} */ (null);
  return /** @type {T} */ (await read(async () => parsed(await response.text()), method, path));
}

/**
 * Wait for what was requested; return it, or the error of a request that failed.
 * @template T
 * @param {Promise<T>} asked
 * @returns {Promise<{answer: T, error: null} | {answer: null, error: RequestError}>}
 */
export async function outcome(asked) {
  try {
    return { answer: await asked, error: null };
  } catch (error) {
    if (!(error instanceof RequestError)) throw error;
    return { answer: null, error };
  }
}

/** Ask the server who is signed in in this browser; kind "nobody" when it is signed out. @returns {Promise<SignInDocument>} */
export function whoAmI() {
  return request("GET", SIGN_IN_PATH);
}

/**
 * Download a file of the server with its name.
 * @param {string} path below /api/v1
 * @returns {Promise<{content: Blob, name: string}>}
 */
export async function file(path) {
  const response = await answerTo("GET", path, { patience_ms: 4 * PATIENCE_MS });
  const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? "calibration.json";
  return { content: await read(() => response.blob(), "GET", path), name };
}

/**
 * Read a body; one that is cut off or comes too late is a RequestError too.
 * @template T
 * @param {() => Promise<T>} body
 * @param {string} method
 * @param {string} path
 */
async function read(body, method, path) {
  try {
    return await body();
  } catch (error) {
    throw new RequestError(unreachable(method, path, error));
  }
}

/** @param {string} method @param {string} path @param {Options} options */
async function answerTo(method, path, options) {
  const { body, headers = {}, patience_ms = PATIENCE_MS, keepalive = false } = options;
  if (signIn.over && path !== SIGN_IN_PATH && path !== STOP_PATH) throw new RequestError(signedOut(method, path));
  let response;
  try {
    response = await fetch(API + path, {
      method,
      headers: body === undefined ? headers : { "Content-Type": typeOf(body), ...headers },
      body: body === undefined ? null : body instanceof Blob ? body : JSON.stringify(body),
      cache: "no-store",
      // a command, STOP above all, does not wait for the reads of other tabs
      priority: method === "GET" ? "low" : "high",
      keepalive,
      signal: AbortSignal.timeout(patience_ms),
    });
  } catch (error) {
    throw new RequestError(unreachable(method, path, error));
  }
  if (!response.ok) throw refusedBy(new RequestError(await problemOf(response)));
  return response;
}

/** @param {unknown} body a part of a file, or what is sent as JSON */
function typeOf(body) {
  return body instanceof Blob ? "application/octet-stream" : "application/json";
}

/** Report an error that means that this browser's sign-in is no longer accepted. @param {RequestError} error */
function refusedBy(error) {
  if (error.slug === SIGNED_OUT) signIn.refuse();
  return error;
}

/** @param {string} method @param {string} path @returns {Problem} */
function signedOut(method, path) {
  return {
    type: `/problems/${SIGNED_OUT}`,
    title: "This browser is signed out",
    status: 401,
    detail: `${method} ${path} was not sent.`,
    remedy: "Sign in again.",
  };
}

/** @param {string} method @param {string} path @param {unknown} error @returns {Problem} */
function unreachable(method, path, error) {
  const late = error instanceof DOMException && error.name === "TimeoutError";
  return {
    type: "/problems/offline",
    title: late ? "No answer in time" : "Server not reachable",
    status: 0,
    detail: `${method} ${path} ${late ? "got no answer in time" : "did not reach the server"}.`,
    remedy: "The page reconnects by itself. If it does not, see whether the server still runs.",
  };
}

/** @param {Response} response @returns {Promise<Problem>} */
async function problemOf(response) {
  const fallback = { type: "/problems/internal", title: response.statusText || "Error", status: response.status };
  try {
    const document = await response.json();
    const detail = typeof document.detail === "string" ? document.detail : `The server answered ${response.status}.`;
    return { ...fallback, ...document, detail };
  } catch {
    return { ...fallback, detail: `The server answered ${response.status} without saying why.` };
  }
}
