// SPDX-License-Identifier: MIT
// State of the page in the URL's hash, so that it can be shared and the back button goes through it. Pure functions, but for go().

/** "#/axis/x1?from=1&to=2" -> { path: ["axis", "x1"], query: { from: "1", to: "2" } }. */
export function parse(hash) {
  const text = String(hash ?? "").replace(/^#\/?/, "");
  const cut = text.indexOf("?");
  const decode = (s) => { try { return decodeURIComponent(s); } catch { return s; } };
  return {
    path: (cut < 0 ? text : text.slice(0, cut)).split("/").filter(Boolean).map(decode),
    query: Object.fromEntries(new URLSearchParams(cut < 0 ? "" : text.slice(cut + 1))),
  };
}

/** The inverse; empty values drop out. */
export function link(path, query = {}) {
  const pairs = Object.entries(query).filter(([, value]) => value !== null && value !== undefined && value !== "");
  const tail = new URLSearchParams(pairs.map(([k, v]) => [k, String(v)])).toString().replaceAll("%2C", ",").replaceAll("%3A", ":");
  return "#/" + path.map(encodeURIComponent).join("/") + (tail ? "?" + tail : "");
}

/** Changes part of the state; `replace` leaves no step for the back button. What is asked for once more is loaded anew. */
export function go(path, query, { replace = false } = {}) {
  const to = link(path, query);
  if (!replace && to !== location.hash) {
    location.hash = to;
    return;
  }
  if (to !== location.hash) history.replaceState(null, "", to);
  dispatchEvent(new HashChangeEvent("hashchange"));
}
