// SPDX-License-Identifier: MIT
// Questions to /api/v1. A write that is refused for want of a token asks the person for it, once more if it was wrong.
import { askToken } from "./dialogs.js";

const BASE = "api/v1/";
const TOKEN = "resonid-token";
/** A question that takes longer is given up: the server is gone. */
const PATIENCE_MS = 15000;

export class ApiError extends Error {
  constructor(status, message, field = "") {
    super(message);
    this.status = status;
    this.field = field;
  }
}

const KINDS = { 0: "The server does not answer", 403: "Not allowed", 404: "Not found", 429: "Too many requests; try again shortly", 503: "The server is busy; try again shortly" };

async function ask(path, options = {}) {
  const token = sessionStorage.getItem(TOKEN);
  const headers = { ...options.headers, ...(token ? { Authorization: `Bearer ${token}` } : {}) };
  let answer;
  try {
    answer = await fetch(BASE + path, { ...options, headers, cache: "no-store", signal: options.signal ?? AbortSignal.timeout(PATIENCE_MS) });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError(0, KINDS[0]);
  }
  const body = await answer.json().catch(() => null);
  if (answer.ok) return body ?? {};
  const told = body?.error ?? {};
  throw new ApiError(answer.status, told.message ?? KINDS[answer.status] ?? `The server answered ${answer.status}`, told.field ?? "");
}

/** Asks `send` again with a token as long as it is refused and the person gives one. */
async function withToken(send) {
  for (let wrong = false; ; wrong = true) {
    try {
      return await send();
    } catch (error) {
      if (!(error instanceof ApiError) || error.status !== 401) throw error;
      const had = sessionStorage.getItem(TOKEN) !== null;
      const token = await askToken(wrong || had);
      if (token === null) throw error;
      sessionStorage.setItem(TOKEN, token);
    }
  }
}

export const get = (path, signal) => ask(path, { signal });

export const post = (path, body) => withToken(() =>
  ask(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }));

/** Address of something that a link leads to. */
export const address = (path) => BASE + path;
export const part = encodeURIComponent;
