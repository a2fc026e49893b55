// SPDX-License-Identifier: MIT
// The page's one stream of events, opened anew when it breaks. The browser's own reconnection tells the server the last event that it
// saw; after one of ours the server says that the stream is not resumed, and what was missed is asked for.

/** Without an event for so long the connection is opened anew: a dead one tells nothing. */
const SILENT_MS = 20000;
/** To connect may take longer; where nothing answers the browser would wait for minutes. */
const HANGS_MS = 60000;
const FIRST_WAIT_MS = 1000;
const LONGEST_WAIT_MS = 10000;
const EVENTS = ["hello", "frame", "alarm", "axis", "response"];

export class Stream {
  /** `handlers`: one for each of the events, given its data; state(name): "connecting", "open" or "broken"; refused().
   *  `token` tells the one that reading needs, or null. */
  constructor(handlers, token) {
    this.handlers = handlers;
    this.token = token;
    this.axis = null;
    this.source = null;
    this.waits = FIRST_WAIT_MS;
    this.state = "connecting";
    this.full = false; // refused because too many streams are open, as the page found out
    this.brokenAt = null;
    this.heard = performance.now();
    setInterval(() => {
      const waits = this.state === "open" ? SILENT_MS : this.source?.readyState === EventSource.CONNECTING ? HANGS_MS : Infinity;
      if (performance.now() - this.heard > waits) this.reopen();
    }, 2000);
    addEventListener("online", () => { if (this.state === "broken") this.reopen(); });
  }

  /** Also the response and fast figures of one axis, or null. */
  follow(axis) {
    if (this.source !== null && axis === this.axis) return;
    this.axis = axis;
    this.open();
  }

  open() {
    clearTimeout(this.timer);
    this.source?.close();
    const query = new URLSearchParams();
    if (this.axis) query.set("axis", this.axis);
    // An EventSource sends no header of ours.
    if (this.token()) query.set("token", this.token());
    const text = query.toString();
    const source = new EventSource("api/v1/stream" + (text ? "?" + text : ""));
    this.source = source;
    this.heard = performance.now();
    source.onopen = () => {
      this.waits = FIRST_WAIT_MS;
      this.heard = performance.now();
      this.full = false;
      this.become("open");
    };
    source.onerror = () => {
      if (source !== this.source) return;
      this.become("broken");
      // The browser tries again by itself, unless the server refused.
      if (source.readyState !== EventSource.CLOSED) {
        this.full = false;
        return;
      }
      this.handlers.refused();
      this.later();
    };
    for (const name of EVENTS) {
      source.addEventListener(name, (event) => {
        if (source !== this.source) return;
        this.heard = performance.now();
        let data;
        try {
          data = JSON.parse(event.data);
        } catch {
          return console.error(`stream: ${name} is no JSON`);
        }
        this.handlers[name](data);
      });
    }
  }

  reopen() {
    this.become("broken");
    this.open();
  }

  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.open(), this.waits);
    this.waits = Math.min(2 * this.waits, LONGEST_WAIT_MS);
  }

  become(state) {
    if (state === this.state) return;
    this.brokenAt = state === "broken" ? performance.now() : null;
    this.state = state;
    this.handlers.state(state);
  }
}
