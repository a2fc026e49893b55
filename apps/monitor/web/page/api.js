// SPDX-License-Identifier: MIT
// Questions to /api/v1. A write that is refused for want of a token asks the person for it, once more if it was wrong.
import { askToken } from "./dialogs.js";
import { h } from "./dom.js";

const BASE = "api/v1/";
const TOKEN = "resonid-token";
/** A question that takes longer is given up: the server is gone. */
const PATIENCE_MS = 15000;

class ApiError extends Error {
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

/** One question for a token, however many requests are refused meanwhile. */
let asking = null;
let readingNeedsIt = false;
let refused = false;

/** Asks `send` again with a token as long as it is refused and the person gives one. */
async function withToken(send) {
  for (let wrong = false; ; wrong = true) {
    const used = sessionStorage.getItem(TOKEN);
    try {
      return await send();
    } catch (error) {
      if (!(error instanceof ApiError) || error.status !== 401) throw error;
      if (sessionStorage.getItem(TOKEN) !== used) continue;
      asking ??= askToken(wrong || used !== null).finally(() => { asking = null; });
      const token = await asking;
      if (token === null) throw error;
      sessionStorage.setItem(TOKEN, token);
    }
  }
}

/** The token, where reading needs it, too. */
export const readToken = () => (readingNeedsIt ? sessionStorage.getItem(TOKEN) : null);

/** A person who gave no token is not asked by each of the page's own questions again. */
export const get = (path, signal) => (refused ? ask(path, { signal }) : withToken(async () => {
  try {
    return await ask(path, { signal });
  } catch (error) {
    if (error.status === 401) readingNeedsIt = true;
    throw error;
  }
}).catch((error) => {
  if (error.status === 401) refused = true;
  throw error;
}));

export const post = (path, body) => withToken(() =>
  ask(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }));

/** A link to a file of the interface. Where reading needs a token, it has it for as long as it is followed: not when it is copied. */
export function fileLink(path, text, attributes = {}) {
  const address = BASE + path;
  const link = h("a", {
    ...attributes, href: address, onclick: () => {
      if (!readToken()) return;
      link.href = `${address}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(readToken())}`;
      setTimeout(() => { link.href = address; });
    },
  }, text);
  return link;
}
export const part = encodeURIComponent;
