// SPDX-License-Identifier: MIT
// What a person is asked before something is done. The browser's own <dialog> keeps the focus and gives it back.
import { h, nearest, say } from "./dom.js";
import { duration } from "./words.js";

const WHO = "resonid-who";

/** Shows a dialog with fields; `run(values)` does it and may throw, which is told there. Resolves to what it returned, or null. */
function askAndDo({ title, text = "", fields, button, run }) {
  return new Promise((resolve) => {
    const error = h("p", { class: "error", role: "alert" });
    const inputs = fields.map((f) => control(f));
    const confirm = h("button", { type: "submit" }, button);
    const id = `dialog-${++controls}`; // a question for a token may stand above another one
    let result = null;
    const opener = document.activeElement;
    const dialog = h("dialog", { "aria-labelledby": id },
      h("form", {
        method: "dialog", onsubmit: async (event) => {
          event.preventDefault();
          const focused = document.activeElement; // what is disabled loses it
          confirm.disabled = true;
          say(error, "");
          try {
            result = await run(Object.fromEntries(inputs.map(({ name, read }) => [name, read()])));
            dialog.close();
          } catch (problem) {
            say(error, problem.message);
            confirm.disabled = false;
            focused?.focus();
          }
        },
      },
      h("h2", { id }, title), text ? h("p", { class: "explain" }, text) : null,
      inputs.map((i) => i.part), error,
      h("div", { class: "buttons" }, confirm, h("button", { type: "button", class: "plain-button", onclick: () => dialog.close() }, "Cancel"))));
    dialog.addEventListener("close", () => {
      dialog.remove();
      // The button may have been written anew meanwhile.
      if (opener && !opener.isConnected) {
        const content = document.getElementById("content");
        ((opener.dataset.focus && nearest(content, opener.dataset.focus)) || content).focus({ preventScroll: true });
      }
      resolve(result);
    });
    document.body.append(dialog);
    dialog.showModal();
    (inputs.find((i) => !i.element.value) ?? inputs[0])?.element.focus();
  });
}

let controls = 0;

function control({ name, label, kind = "text", options, required = true, value = "", autocomplete = "off", most = 200 }) {
  const id = `field-${++controls}`;
  const common = { id, required, name, autocomplete };
  const element = kind === "select"
    ? h("select", common, options.map(([v, text]) => h("option", { value: v }, text)))
    : kind === "area" ? h("textarea", { ...common, rows: 3, maxlength: most }) : h("input", { ...common, type: kind, maxlength: most });
  if (value) element.value = value;
  // The server takes one line.
  return { name, element, read: () => element.value.trim().replace(/\s+/g, " "), part: h("div", { class: "field" }, h("label", { for: id }, label), element) };
}

/** As askAndDo(), with who does it, kept for the next time, and why, which may be `optional`. */
export const askPerson = (what) => askAndDo({
  ...what,
  fields: [{ name: "who", label: "Your name", value: localStorage.getItem(WHO) ?? "", autocomplete: "name" },
    { name: "reason", label: what.optional ? "Reason (optional)" : "Reason", kind: "area", required: !what.optional }, ...(what.fields ?? [])],
  run: async (values) => {
    const done = await what.run(values);
    localStorage.setItem(WHO, values.who);
    return done ?? true;
  },
});

const DURATIONS = [[3600, "1 hour"], [4 * 3600, "4 hours"], [8 * 3600, "8 hours"], [86400, "1 day"], [3 * 86400, "3 days"], [7 * 86400, "1 week"], [30 * 86400, "30 days"]];

/** Choices of how long (s), up to the longest that is allowed, which stands alone where all others are longer. */
export function durations(longest = Infinity) {
  const some = DURATIONS.filter(([seconds]) => seconds <= longest);
  return some.length ? some : [[longest, duration(longest)]];
}

const TOKEN_FOR = { read: "The server shows its data only with a token.", write: "The server takes changes only with a token." };

/** A token for reading or writing ("read", "write"); `why` the one before was not enough. Null when the person gives none. */
export const askToken = (what, why) => askAndDo({
  title: what === "read" ? "Token needed to read" : "Token needed", text: [why, TOKEN_FOR[what], "It is kept until this tab is closed."].filter(Boolean).join(" "),
  fields: [{ name: "token", label: "Token", kind: "password", autocomplete: "current-password", most: null }], button: "Continue", run: async ({ token }) => token,
});

/** A line that says what was done; gone after a while. */
export function notice(text, kind = "good") {
  const line = h("div", { class: `notice ${kind}` }, text);
  document.getElementById("notices").append(line);
  setTimeout(() => line.remove(), 8000);
}
