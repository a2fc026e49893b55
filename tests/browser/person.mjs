// SPDX-License-Identifier: MIT
// What the browser tests have in common: the browser, and what a person sees and does on a page.
// RESONID_CHROMIUM names the browser, RESONID_PACKAGES the folder of node_modules if it is not this one; RESONID_SCREENSHOTS a folder that
// gets pictures of every page.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

const given = process.env.RESONID_CHROMIUM;
export const CHROMIUM = given !== undefined && existsSync(given) ? given : ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
export const SKIP = CHROMIUM ? false : "SKIPPED: no chromium found; install the package 'chromium' or set RESONID_CHROMIUM";
export const PICTURES = process.env.RESONID_SCREENSHOTS;
/** A machine that others use, too, is slow (RESONID_PATIENCE, in seconds); nobody waits for so long where things are as they should be. */
export const PATIENCE = 1000 * Number(process.env.RESONID_PATIENCE ?? 60);

/** The browser, and the source of axe. */
export async function launch() {
  // Where npm put them: beside this file, or in a build folder.
  const { resolve } = createRequire(process.env.RESONID_PACKAGES ? path.join(process.env.RESONID_PACKAGES, "x.mjs") : import.meta.url);
  const { default: puppeteer } = await import(pathToFileURL(resolve("puppeteer-core")));
  const browser = await puppeteer.launch({ executablePath: CHROMIUM, headless: true, args: process.getuid?.() === 0 ? ["--no-sandbox"] : [] });
  return { browser, axe: readFileSync(resolve("axe-core/axe.min.js"), "utf8") };
}

/** A fresh page; what goes wrong on it is added to `troubles`, where it asks to `requested`. */
export async function open(browser, { width = 1280, height = 900, dark = false } = {}, troubles = [], requested = new Set()) {
  const page = await (await browser.createBrowserContext()).newPage();
  page.setDefaultTimeout(PATIENCE);
  page.on("console", (m) => { if (m.type() === "error") troubles.push(m.text()); });
  page.on("pageerror", (e) => troubles.push(String(e.message)));
  page.on("request", (r) => { if (!/^(data|blob):/.test(r.url())) requested.add(new URL(r.url()).origin); });
  await page.setViewport({ width, height });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }]);
  return page;
}

export async function picture(page, name, fullPage = true) {
  if (!PICTURES) return;
  mkdirSync(PICTURES, { recursive: true });
  await page.screenshot({ path: path.join(PICTURES, `${name}.png`), fullPage });
}

/** Waits until an element stays where it is, for three pictures: what is above it may still be filled in. */
function still(element) {
  element.scrollIntoView({ block: "nearest" });
  return new Promise((done) => {
    let last = "", same = 0;
    const look = () => {
      const { x, y } = element.getBoundingClientRect(), now = `${x} ${y}`;
      same = now === last ? same + 1 : 0;
      last = now;
      if (same === 3) done();
      else requestAnimationFrame(look);
    };
    look();
  });
}

/** What a person sees and does on the page that `now()` returns. */
export function person(now) {
  const text = (selector) => now().$eval(selector, (e) => e.innerText.replace(/\s+/g, " ").trim());
  const button = (label, within = "") => now().waitForSelector(`::-p-xpath(//*[${within || "true()"}]//button[normalize-space(.)='${label}'])`);
  return {
    text, button,
    texts: (selector) => now().$$eval(selector, (all) => all.map((e) => e.innerText.replace(/\s+/g, " ").trim())),
    hash: () => now().evaluate(() => decodeURIComponent(location.hash)),
    /** Again where what stands there is just written anew, or moved away under the pointer. */
    async press(label) {
      for (const tries of [1, 2, 3, 4, 5]) {
        try {
          const found = await button(label);
          await found.evaluate(still);
          await found.evaluate((e) => e.addEventListener("click", () => { e.pressed = true; }, { once: true, capture: true }));
          await found.click();
          if (await found.evaluate((e) => e.pressed)) return;
          if (tries === 5) throw new Error(`'${label}' moves away`);
        } catch (error) {
          if (tries === 5 || !/detached|not clickable/.test(error.message)) throw error;
        }
      }
    },
    focused: () => now().evaluate(() => document.activeElement.innerText || document.activeElement.id),

    /** Waits until a text says something, and tells what it said if it does not. */
    async says(selector, wanted, timeout = PATIENCE) {
      try {
        await now().waitForFunction((s, source, flags) => new RegExp(source, flags).test(document.querySelector(s)?.innerText.replace(/\s+/g, " ").trim() ?? ""), { timeout }, selector, wanted.source, wanted.flags);
      } catch {
        assert.match(await now().$(selector) ? await text(selector) : `(no ${selector})`, wanted);
      }
    },

    /** Fills in the dialog that is open, and confirms it. */
    async answer(values) {
      await now().waitForSelector("dialog[open]");
      for (const [name, value] of Object.entries(values)) {
        const field = await now().$(`dialog [name="${name}"]`);
        if (await field.evaluate((e) => e.tagName === "SELECT")) await field.select(value);
        else {
          await field.evaluate((e) => { e.value = ""; });
          await field.type(value);
        }
      }
      await now().click("dialog button[type=submit]");
    },
  };
}

/** Nothing on a page may be wider than it, and axe finds nothing. */
export async function fits(page, axe, what) {
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(wide <= 0, `${what} is ${wide} pixels too wide`);
  await page.evaluate(axe);
  const found = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.failureSummary}`).slice(0, 3).join("; ")}`), [], what);
}
