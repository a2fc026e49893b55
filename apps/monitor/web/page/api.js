// SPDX-License-Identifier: MIT
// Questions to /api/v1. One that is refused for want of a token asks the person for it, once more if it was wrong.
import { askToken } from "./dialogs.js";
import { h } from "./dom.js";

const BASE = "api/v1/";
const TOKEN = "resonid-token";
const READING = "resonid-token-reads";
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

const authorization = (token) => (token ? { Authorization: `Bearer ${token}` } : {});

/** A question that can be called off is given up after the same time, too. */
function signalOf(given) {
  const late = AbortSignal.timeout(PATIENCE_MS);
  return given ? AbortSignal.any?.([given, late]) ?? given : late;
}

async function ask(path, token, options = {}) {
  const headers = { ...options.headers, ...authorization(token) };
  let answer;
  try {
    answer = await fetch(BASE + path, { ...options, headers, cache: "no-store", signal: signalOf(options.signal) });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError(0, KINDS[0]);
  }
  const body = await answer.json().catch(() => null);
  if (answer.ok) return body ?? {};
  const told = body?.error ?? {};
  throw new ApiError(answer.status, told.message ?? KINDS[answer.status] ?? `The server answered ${answer.status}`, told.field ?? "");
}

const stored = () => sessionStorage.getItem(TOKEN);
/** One question for a token, however many requests are refused meanwhile. */
let asking = null;
/** A person gave none to read with: the page's own questions leave it at that until the person does something. */
let declined = false;
for (const act of ["pointerdown", "keydown", "hashchange"]) addEventListener(act, () => { declined = false; }, { capture: true });

/** Whether another token may help: there is none, it is wrong, or it is for reading only. */
const wantsToken = ({ status, field }, token) => status === 401 || (status === 403 && field === "authorization" && token !== null);

/** Asks `send(token)` again as long as it is refused for want of a token and the person gives one; one that is taken is kept. */
async function withToken(what, send) {
  let known = stored();
  for (let token = known; ;) {
    try {
      const answer = await send(token);
      if (token !== known) sessionStorage.setItem(TOKEN, token);
      return answer;
    } catch (error) {
      if (!(error instanceof ApiError) || !wantsToken(error, token)) throw error;
      if (stored() !== known) {
        known = token = stored();
        continue;
      }
      if (what === "read" && declined) throw error;
      const why = error.status === 403 ? "The token in use is for reading only." : token !== null ? "The server did not take the token." : "";
      asking ??= askToken(what, why).finally(() => { asking = null; });
      const given = await asking;
      if (given === null) {
        declined = what === "read";
        throw error;
      }
      token = given;
    }
  }
}

/** The token, where reading needs it, too. */
export const readToken = () => (sessionStorage.getItem(READING) ? stored() : null);

export const get = (path, signal) => withToken("read", async (token) => {
  try {
    return await ask(path, token, { signal });
  } catch (error) {
    if (error.status === 401) sessionStorage.setItem(READING, "needs it");
    throw error;
  }
});

export const post = (path, body) => withToken("write", (token) =>
  ask(path, token, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }));

/** Whether a stream is refused because too many are open, which an EventSource does not tell. */
export async function streamsAreFull() {
  const end = new AbortController();
  const late = setTimeout(() => end.abort(), PATIENCE_MS);
  try {
    const answer = await fetch(`${BASE}stream`, { headers: authorization(stored()), cache: "no-store", signal: end.signal });
    return !answer.ok && (await answer.json()).error?.field === "streams";
  } catch {
    return false;
  } finally {
    clearTimeout(late);
    end.abort();
  }
}

/** A link to a file of the interface. Where reading needs a token, it has it for as long as it is followed: not when it is copied. */
export function fileLink(path, text, attributes = {}) {
  const address = BASE + path;
  const lend = () => {
    if (!readToken()) return;
    link.href = `${address}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(readToken())}`;
    setTimeout(() => { link.href = address; });
  };
  const link = h("a", { ...attributes, href: address, onclick: lend, onauxclick: lend }, text); // the latter: in another tab
  return link;
}
export const part = encodeURIComponent;
