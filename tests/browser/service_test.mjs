// SPDX-License-Identifier: MIT
// What a person does on the page of the real `resonid monitor`, in a real browser: a simulated belt loosens, twenty times faster than real
// time, beside a drive that stays as it is, in real time. The tests are one visit and follow each other. RESONID_PROGRAM is the command line tool.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { fits, launch, open, PATIENCE, person, picture, SKIP } from "./person.mjs";

const EXPERIMENTS = fileURLToPath(new URL("../../experiments", import.meta.url));
const CONTROLLER = 'sample_rate_hz = 500.0\ninput = "u"\noutput = "y"\nexcitation = "ru"\ncontroller = "pi:1.036,0.147"\ndelay_s = 0.004\nbaseline_s = 30.0\n';
const CONFIGURATION = `
[monitor]
data = "data"
listen = "127.0.0.1:0"
[source.simulated]
kind = "demo"
experiments = ["belt.toml"]
speed = 20.0
[source.slow]
kind = "demo"
experiments = ["steady.toml"]
[axis.belt]
source = "simulated"
${CONTROLLER}
[axis.steady]
source = "slow"
${CONTROLLER}`;

const DESKTOP = { width: 1280, height: 900 };
const PHONE = { width: 390, height: 844 };
const ALARM_MS = 2 * PATIENCE; // the belt loosens after four seconds

describe("page of the real service", { skip: SKIP }, () => {
  let folder;
  let service;
  let url;
  let browser;
  let axe;
  let page;
  const troubles = [];
  const requested = new Set();
  const { texts, hash, says, press, answer, focused } = person(() => page);
  const row = (name) => `.row[data-axis="${name}"]`;
  const told = async (what) => (await fetch(`${url}api/v1/${what}`)).json();
  const alarm = async () => (await told("alarms?axis=belt&limit=100")).alarms.find((a) => a.alarm === "stiffness");
  const visit = async (where) => {
    await page.goto(`${url}${where}`);
    await says("#strip .connection", /^Connected$/);
  };

  before(async () => {
    folder = mkdtempSync(path.join(tmpdir(), "resonid-page-"));
    const experiment = readFileSync(path.join(EXPERIMENTS, "belt_loosens.toml"), "utf8");
    const loosens = (share, at, over) => experiment.replace(/^loosening = .*$/m, `loosening = ${share}`).replace(/^loosening_at_s = .*$/m, `loosening_at_s = ${at}`).replace(/^loosening_over_s = .*$/m, `loosening_over_s = ${over}`);
    writeFileSync(path.join(folder, "belt.toml"), loosens("0.1", "80.0", "5.0"));
    writeFileSync(path.join(folder, "steady.toml"), loosens("0.0", "80.0", "5.0"));
    writeFileSync(path.join(folder, "monitor.toml"), CONFIGURATION);
    service = spawn(process.env.RESONID_PROGRAM, ["monitor", "monitor.toml"], { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
    let said = "";
    url = await new Promise((resolve, reject) => {
      service.on("exit", (code) => reject(new Error(`the service ended with ${code}: ${said}`)));
      for (const stream of [service.stdout, service.stderr]) {
        stream.on("data", (data) => {
          said += data;
          const found = /http:\/\/\S+\//.exec(said);
          if (found) resolve(found[0]);
        });
      }
    });
    ({ browser, axe } = await launch());
    page = await open(browser, DESKTOP, troubles, requested);
  });
  after(async () => {
    await browser?.close();
    if (service?.exitCode === null && service.signalCode === null) {
      service.kill("SIGKILL");
      await new Promise((resolve) => { service.on("exit", resolve); });
    }
    if (folder) rmSync(folder, { recursive: true, force: true });
  });

  function noTrouble() {
    assert.deepEqual(troubles, []);
    assert.deepEqual([...requested], [url.replace(/\/$/, "")], "everything comes from the server itself");
  }

  test("axes come up by themselves, with the age of their data and the way to here", async () => {
    await visit("");
    await says(`${row("belt")} .state`, /^Trusted$/, ALARM_MS);
    await says(`${row("belt")} .values`, /^Resonance 1[45]\.\d+ ± 0\.\d+ Hz/);
    await says("#strip .age", /^Data 0\.\d+ s old$/);
    await says("#strip .latency", /^Latency \d+ ms$/);
    noTrouble();
  });

  test("the belt that loosens comes first, and says what changed and why", async () => {
    await says(`${row("belt")} .why`, /Alarm: .* fell by/, ALARM_MS);
    await page.waitForFunction(async () => (await (await fetch("api/v1/alarms?axis=belt&limit=100")).json()).alarms.some((a) => a.alarm === "stiffness"), { timeout: ALARM_MS, polling: 200 });
    assert.deepEqual(await page.$$eval(".row", (rows) => rows.map((r) => r.dataset.axis)), ["belt", "steady"]);
    await says("#strip .alarms", /^\d+ alarms? open, \d+ not acknowledged$/);
    await says(`${row("belt")} .values`, /Stiffness [\d.]+ ± [\d.]+ Nm\/rad \(−[\d.]+ ± [\d.]+\) %, alarm/);
    await picture(page, "service-fleet");
    await fits(page, axe, "fleet");
    noTrouble();
  });

  test("the axis shows its response with bands, the loop with its circle, and trends with the alarm", async () => {
    await visit("#/axis/belt?span=600&f=stiffness");
    await page.waitForFunction(() => document.querySelectorAll(".live canvas").length >= 3 && document.querySelectorAll(".trends canvas").length === 1);
    await says(".live", /Magnitude .*Phase .*Coherence/);
    await says(".live .legend", /now .*68\.3 % confidence/);
    await says(".nyquist", /Phase margin [\d.]+ ± [\d.]+ °.*Modulus margin [\d.]+ ± [\d.]+/);
    assert.ok(await page.$(".nyquist svg circle"), "the circle around -1");
    await says(".trends .legend", /Stiffness, ± one standard deviation .*alarm/);
    await says(".verdict", /^Alarm .* fell by/);
    await says(".gates", /Excited: yes .*Converged: yes/);
    await says(".figures-table", /Stiffness [\d.]+ ± [\d.]+ Nm\/rad [\d.]+ Nm\/rad \(−[\d.]+ ± [\d.]+\) %/);
    assert.ok(await page.$eval(".figures-table tr:nth-child(3) [data-name=Change]", (e) => e.hasAttribute("data-beyond")), "the change that alarms is marked");
    await picture(page, "service-axis");
    await fits(page, axe, "axis");
    noTrouble();
  });

  test("what is shown stands in the address, and survives a reload", async () => {
    await press("10 min");
    await press("Load inertia");
    await page.waitForFunction(() => document.querySelectorAll(".trends h3").length === 2);
    const before = await hash();
    await page.reload();
    await page.waitForFunction(() => document.querySelectorAll(".trends canvas").length === 2);
    assert.equal(await hash(), before);
    assert.deepEqual(await texts(".trends h3"), ["Stiffness", "Load inertia"]);
    noTrouble();
  });

  test("the belt's alarm is acknowledged and shelved by the keyboard, with a reason and an end", async () => {
    const { id } = await alarm();
    await visit(`#/alarm/${id}`);
    await says("main", /Change from [\d.]+ ± [\d.]+ Nm\/rad to .* standard deviations .*cause belt or coupling looser/);
    const act = async (label, values) => {
      for (let i = 0; i < 15 && (await focused()) !== label; ++i) await page.keyboard.press("Tab");
      assert.equal(await focused(), label);
      await page.keyboard.press("Enter");
      await page.waitForSelector("dialog[open]");
      await answer(values);
    };
    await act("Acknowledge", { who: "Kim", reason: "belt is ordered" });
    await says(".verdict", /^Active acknowledged$/);
    await act("Shelve", { reason: "comes on Friday", seconds: "86400" });
    await says(".verdict", /^Active acknowledged, shelved until \d{4}-\d\d-\d\d \d\d:\d\d by Kim: comes on Friday$/);
    await page.reload();
    await says("main", /Shelved until \d{4}-\d\d-\d\d .* by Kim: comes on Friday/);
    await says("main", /Raised .*Acknowledged Kim belt is ordered .*Shelved Kim comes on Friday/);
    await visit("#/alarms?state=shelved");
    await says(".alarm-list", /belt: Stiffness fell .*shelved until .* by Kim: comes on Friday/);
    await visit("#/status");
    await says("main", /belt shelve stiffness Kim comes on Friday/i);
    await picture(page, "service-status");
    await fits(page, axe, "status");
    noTrouble();
  });

  test("evidence is one step from the alarm: the samples, and a report of them", async () => {
    const { id } = await alarm();
    await visit(`#/alarm/${id}`);
    await page.waitForSelector(".links a[href$='evidence.csv']");
    await picture(page, "service-alarm");
    await fits(page, axe, "alarm");
    const csv = await page.waitForFunction(async () => {
      const answer = await fetch(document.querySelector(".links a[href$='evidence.csv']").href);
      return answer.ok && answer.text();
    }, { polling: 500 });
    assert.match(await csv.jsonValue(), /^# axis belt, samples \d+ to \d+; resonid identify alarm-\d+\.csv --time t_s .*--controller pi:1\.036,0\.147 .*--report alarm-\d+\.html\nt_s,ru,u,y\n0,/);
    await page.click(".links a[href$='report.html']");
    await page.waitForSelector("canvas");
    await says("body", /two-inertia \(two-mass\) drive/);
    await says(".provenance", new RegExp(`Program resonid ${(await told("status")).version} .*Command resonid identify alarm-${id}\\.csv --time t_s .*--controller pi:1\\.036,0\\.147 .*--report alarm-${id}\\.html alarm-${id}\\.csv SHA-256`));
    assert.ok(!(await page.content()).includes(folder), "where it lies on the server is not told");
    await picture(page, "service-report", false);
    await page.goBack();
    await says("h1", /^Stiffness fell/);
    noTrouble();
  });

  test("two dates are compared, and the belt alone differs", async () => {
    const { since_time_s: since } = await alarm();
    // Means of five minutes to either side.
    await visit(`#/axis/belt/compare?a=${since - 310}&b=${since + 320}`);
    await says("main", /[1-9]\d* of \d+ figures differ significantly/);
    const rows = await texts("main section:first-of-type tbody tr");
    assert.match(rows.find((r) => r.startsWith("Stiffness")), /\(−\d+\.?\d* ± \d+\.\d+\) % [\d.]+ yes$/);
    await picture(page, "service-compare");
    await fits(page, axe, "compare");
    noTrouble();
  });

  test("a baseline is set, and what is now is usual", async () => {
    await visit("#/axis/belt");
    await says(".live .legend", /now/);
    assert.doesNotMatch(await texts(".live .legend").then((all) => all.join()), /baseline/, "none is configured, and none was set");
    await press("Set baseline");
    await answer({ reason: "new belt" });
    await says("#notices", /^Baseline set: belt$/);
    await says("main", /\(in use\) Kim new belt Resonance [\d.]+ ± [\d.]+ Hz/);
    await says(".live .legend", /now .*baseline/);
    await says(".nyquist", /L of the baseline, controller of now/);
    await page.waitForFunction(async () => (await (await fetch("api/v1/alarms?axis=belt&limit=100")).json()).alarms.every((a) => a.alarm !== "stiffness" || !a.active), { polling: 200, timeout: ALARM_MS });
    await visit("#/alarms?state=all");
    await says(".alarm-list", /belt: Stiffness .*cleared/);
    noTrouble();
  });

  test("maintenance stands in the fleet with its end, and is ended", async () => {
    await visit("#/axis/steady");
    await press("Begin maintenance");
    await answer({ reason: "greasing", seconds: "3600" });
    await says(".maintenance", /^Maintenance until \d{4}-\d\d-\d\d \d\d:\d\d: no alarm of this axis is told\. End maintenance$/);
    await visit("#/");
    await says(`${row("steady")} .row-head`, /Maintenance until \d{4}-\d\d-\d\d \d\d:\d\d$/);
    await visit("#/axis/steady");
    await press("End maintenance");
    await answer({});
    await page.waitForFunction(() => document.querySelector(".maintenance").hidden);
    assert.equal((await told("axes/steady")).maintenance_until_time_s, undefined);
    await visit("#/status");
    await says("main", /steady End maintenance – Kim .*steady Maintenance – Kim greasing/i);
    noTrouble();
  });

  test("the fleet is gone through by the keyboard alone", async () => {
    await visit("");
    await page.waitForSelector(row("steady"));
    await page.keyboard.press("/");
    assert.equal(await focused(), "search");
    await page.keyboard.type("steady");
    await says(".hits", /^1 axis of 2$/);
    await page.keyboard.press("ArrowDown");
    await page.keyboard.press("Enter");
    await says("h1", /^steady$/);
    noTrouble();
  });

  test("a phone shows all of it", async () => {
    await page.setViewport({ ...PHONE, isMobile: true, hasTouch: true });
    for (const [name, where] of [["fleet", ""], ["axis", "#/axis/belt?span=600"], ["alarms", "#/alarms?state=all"], ["status", "#/status"]]) {
      await visit(where);
      if (name === "axis") await page.waitForFunction(() => document.querySelectorAll(".live canvas").length >= 3 && document.querySelector(".trends canvas"));
      await picture(page, `service-${name}-phone`);
      await fits(page, axe, `${name} on a phone`);
    }
    await page.setViewport(DESKTOP);
    noTrouble();
  });

  test("a service that was killed is seen, and what it said last is greyed", async () => {
    await visit("#/axis/belt");
    await page.waitForSelector(".live canvas");
    service.kill("SIGKILL");
    await says("#strip .connection", /^Connection lost [\d.]+ s ago, trying again$/);
    await says("#strip .age", /^No data for ([5-9]|\d\d)(\.\d)? s$/);
    await says(".verdict", /No data|Alarm/);
    await says(".stale-text", /not those of now/);
    await page.waitForSelector(".live.stale");
    assert.match(await page.$eval(".live > section", (e) => getComputedStyle(e, "::before").content), /No data for/);
    await picture(page, "service-killed", false);
    await page.evaluate(() => { location.hash = "#/"; });
    await says(`${row("steady")} .state`, /^No data for/);
    await says("#strip .latency", /^Latency –$/);
    assert.ok(troubles.every((t) => /net::ERR|Failed to load/.test(t)), troubles.join("\n"));
  });
});
