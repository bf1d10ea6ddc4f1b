// What a claim is worth, on the page: badges that open what they rest on, the proved rate, and bounds on the safe side.
//
// LPV_REPORT=/path/to/report.html tests a report of the program; what only the fixture has is tested there.

import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { resolve } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { openReport, settle, startBrowser } from "./browser.mjs";
import { fillPage, makeReport } from "./fixture.mjs";

const root = fileURLToPath(new URL("..", import.meta.url));
const output = `${root}test-output/`;
const LIMIT = { timeout: 180_000 };
const OF_FLIGHT = ["step-cost", "step-stays", "rate-kept"];

let browser;

before(async () => {
  await mkdir(output, { recursive: true });
  browser = await startBrowser();
});

after(() => browser?.close());

async function writePage(name, report) {
  const template = await readFile(`${root}dist/report.html`, "utf8");
  await writeFile(`${output}${name}.html`, fillPage(template, report));
  return `${output}${name}.html`;
}

/** The first number of a text as the page sets it: −1.2 × 10⁻⁸. */
function shownNumber(text) {
  const plain = text.replace(/[⁻⁰¹²³⁴-⁹]+/g, (power) => [...power].map((c) => (c === "⁻" ? "-" : "⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c))).join(""));
  const [, mantissa, , exponent] = plain.replaceAll("−", "-").match(/(-?\d[\d.]*)(\u202f×\u202f10(-?\d+))?/) ?? [];
  return Number(`${mantissa}e${exponent ?? 0}`);
}

const rowOf = (page, run) => page.locator(`#runs tr[data-run="${run.id}"]`);
const badgeOf = (page, run) => rowOf(page, run).locator(".col-verdict .chip-button");
const panelOf = (page) => page.locator("#runs .evidence-row > td > .evidence");

/** A claim's line among the checks of a run, unfolded. */
async function itemInChecks(page, run, id) {
  const checks = page.locator(`#checks details[data-run="${run.id}"]`);
  await checks.evaluate((node) => (node.open = true));
  return itemIn(checks, id).first();
}

const itemIn = (panel, id) => panel.locator(`:scope > ul > li[data-claim="${id}"]`);

for (const [name, width, mode] of [["wide", 1440, "light"], ["wide-dark", 1440, "dark"], ["narrow", 400, "light"], ["narrow-dark", 400, "dark"]]) {
  describe(`${name}`, LIMIT, () => {
    let opened;
    let report;

    before(async () => {
      const file = process.env.LPV_REPORT ? resolve(process.env.LPV_REPORT) : await writePage(`evidence-${name}`, makeReport({ duration_s: 20 }));
      opened = await openReport(browser, file, "desktop", mode, { viewport: { width, height: 900 } });
      report = await opened.page.evaluate(() => JSON.parse(document.getElementById("report-data").textContent));
    });

    after(async () => {
      assert.deepEqual(opened.complaints, []);
      await opened.close();
    });

    test("each run says up to which rate it is proved, rounded down", async () => {
      const { page } = opened;
      const cells = page.locator("#runs .col-rate");
      const hasParameter = report.scheduling.parameter !== "";
      assert.equal(await cells.count(), hasParameter ? report.runs.length : 0);
      for (const run of hasParameter ? report.runs : []) {
        const text = await rowOf(page, run).locator(".col-rate").evaluate((cell) => cell.firstChild.textContent);
        if (run.proved_rate === null) assert.equal(text, "–");
        else if (run.proved_rate === 0) assert.equal(text, "at rest");
        else {
          const shown = shownNumber(text);
          assert.ok(shown <= run.proved_rate && shown > 0.9998 * run.proved_rate, `${text} of ${run.proved_rate}`);
          assert.ok(text.endsWith(` ${report.scheduling.unit}/s`), text);
        }
      }
    });

    test("no bound on a cost is shown below what it is", async () => {
      for (const run of report.runs) {
        const cost = run.guaranteed_cost ?? run.plant_cost_bound ?? run.model_cost_bound;
        if (cost === null) continue;
        const text = await rowOf(opened.page, run).locator(".col-bound").innerText();
        const shown = shownNumber(text.slice(text.indexOf("≤")));
        assert.ok(shown >= cost && shown <= 1.0002 * cost, `${text} of ${cost}`);
      }
    });

    test("a badge opens what the design rests on, and the command that proves it again", async () => {
      const { page } = opened;
      for (const run of report.runs) {
        const badge = badgeOf(page, run);
        assert.equal(await badge.getAttribute("aria-expanded"), "false");
        await badge.focus();
        await page.keyboard.press("Enter");
        const panel = panelOf(page);
        assert.equal(await badge.getAttribute("aria-expanded"), "true");
        assert.equal(await panel.getAttribute("id"), await badge.getAttribute("aria-controls"));
        assert.equal(await panel.locator(":scope > .command code").innerText(), run.certify_command);
        const decisive = run.claims.some((claim) => claim.verdict === run.verdict && !OF_FLIGHT.includes(claim.kind));
        if (decisive) assert.ok((await panel.locator(`:scope > ul > li > .chip-${run.verdict}[aria-expanded="true"]`).count()) === 1, "the claim that decides is open");
        await page.keyboard.press("Escape");
        assert.equal(await panel.count(), 0);
        assert.equal(await badge.getAttribute("aria-expanded"), "false");
        assert.ok(await badge.evaluate((node) => node === document.activeElement), "the focus is back");
      }
    });

    test("a claim shows its system, set, rate and factor on the safe side, and opens its premises", async () => {
      const { page } = opened;
      const run = report.runs.find((r) => r.claims.some((c) => c.kind === "cost" && c.verdict === "proved")) ?? report.runs.find((r) => r.claims.length > 0);
      const claim = run.claims.find((c) => c.kind === "cost" && c.verdict === "proved") ?? run.claims[0];
      const item = await itemInChecks(page, run, claim.id);
      await item.locator(":scope > .chip-button").click();
      const panel = item.locator(":scope > .evidence");
      const facts = Object.fromEntries(await panel.locator(":scope > dl > div").evaluateAll((rows) => rows.map((row) => [row.querySelector("dt").textContent, row.querySelector("dd").textContent])));
      assert.match(facts.About, report.plant.linear ? /linear/ : claim.of === "model" ? /LPV model/ : /nonlinear plant/);
      if (typeof claim.level === "number") assert.ok(shownNumber(facts.Set) <= claim.level, facts.Set);
      if (claim.motion?.motion === "bounded") assert.ok(shownNumber(facts.Rate) <= claim.motion.rate, facts.Rate);
      if (typeof claim.factor === "number") assert.ok(shownNumber(facts.Cost) >= claim.factor, facts.Cost);
      if (claim.margin !== null) assert.ok(shownNumber(facts.Margin) <= claim.margin, facts.Margin);
      if (claim.kind === "cost") {
        const gaps = await panel.locator(":scope > .uncovered").innerText();
        if (!report.plant.linear) assert.match(gaps, /linearisation/);
        for (const gap of [/[Nn]oise/, /[Dd]elay/, /continuous time/]) assert.match(gaps, gap);
      }
      for (const id of claim.premises) {
        const premise = run.claims.find((other) => other.id === id);
        const line = itemIn(panel, id);
        assert.ok((await line.innerText()).includes(premise?.claim ?? "nothing is known"), id);
        if (premise) assert.equal(await line.locator(`:scope > .chip-${premise.verdict}`).count(), 1);
      }
      assert.equal(await panel.locator(":scope > .command code").innerText(), run.certify_command);

      // Escape closes from the inside out
      const inner = claim.premises.find((id) => run.claims.some((other) => other.id === id));
      if (inner) {
        await itemIn(panel, inner).locator(":scope > .chip-button").click();
        assert.equal(await itemIn(panel, inner).locator(":scope > .evidence").count(), 1);
        await settle(page);
        await page.screenshot({ path: `${output}evidence-${name}-claim.png` });
        await page.keyboard.press("Escape");
        assert.equal(await itemIn(panel, inner).locator(":scope > .evidence").count(), 0);
      }
      assert.equal(await panel.count(), 1);
      await page.keyboard.press("Escape");
      assert.equal(await panel.count(), 0);
    });

    test("an open panel is not wider than the page", async () => {
      const { page } = opened;
      const run = report.runs.find((r) => r.verdict === "proved") ?? report.runs[0];
      await badgeOf(page, run).click();
      await settle(page);
      await page.locator(".table-panel").screenshot({ path: `${output}evidence-${name}.png` });
      const [content, wide] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(content <= wide, `${content} > ${wide}`);
      await badgeOf(page, run).click();
      assert.equal(await panelOf(page).count(), 0, "the badge closes too");
    });
  });
}

describe("the fixture", LIMIT, () => {
  const open = async (name, report, use, storage) => {
    const opened = await openReport(browser, await writePage(name, report), "desktop", "light", storage);
    await use(opened.page);
    assert.deepEqual(opened.complaints, []);
    await opened.close();
  };

  test("bounds that need more digits are cut to the safe side", async () => {
    await open("evidence-rounding", makeReport({ duration_s: 2 }), async (page) => {
      const row = rowOf(page, { id: "slpvqr-20" });
      assert.match(await row.locator(".col-rate").innerText(), /^5\.3483 rad\/s\s+in xᵀPx ≤ 19\.999$/);
      assert.match(await row.locator(".col-bound").innerText(), /^≤ 3540\.2/);
      await badgeOf(page, { id: "slpvqr-20" }).click();
      const text = await panelOf(page).innerText();
      for (const part of ["xᵀPx ≤ 19.999", "|ψ̇| ≤ 5.3483 rad/s", "at most 1.0101 xᵀPx", "0.012345"]) assert.ok(text.includes(part), part);
      for (const wrong of ["5.3484", "≤ 20\n", "1.01 xᵀPx", "0.012346"]) assert.ok(!text.includes(wrong), wrong);
    });
  });

  test("where only the set is proved, the rate says so", async () => {
    await open("evidence-half", makeReport({ duration_s: 2 }), async (page) => {
      const text = await rowOf(page, { id: "high-gain" }).locator(".col-rate").innerText();
      assert.match(text, /^–\s+in xᵀPx ≤ 20\s+set alone: 0\.014238 rad\/s$/);
    });
  });

  test("a refuted design shows the state that breaks it, with names and units", async () => {
    await open("evidence-refuted", makeReport({ duration_s: 2 }), async (page) => {
      await badgeOf(page, { id: "lpvqr-limited" }).click();
      const text = await panelOf(page).innerText();
      for (const line of [/Counter-example at ψ = 0\.3 rad with ψ̇ = 2 rad\/s/, /r\s?x\s+1 m\n/, /φ\s+0\.1 rad/, /ψ\s+3\.1416 rad/]) assert.match(text, line);
      await page.locator(".table-panel").screenshot({ path: `${output}evidence-refuted.png` });
    });
  });

  test("a bound names what it bounds, and says what it does not cover", async () => {
    const report = makeReport({ duration_s: 2 });
    const [flown, model, plant] = report.runs;
    Object.assign(plant, { guaranteed_cost: null, plant_cost_bound: 0.02, model_cost_bound: null, actual_cost: 0.019, guaranteed_cost_verdict: "proved" });
    Object.assign(flown, { guaranteed_cost: flown.actual_cost * 1.5, model_cost_bound: null, guaranteed_cost_of: "plant", guaranteed_cost_verdict: "proved" });
    Object.assign(model, { guaranteed_cost: null, model_cost_bound: 1.3, actual_cost: 1.3595, guaranteed_cost_verdict: "numerical" });
    await open("evidence-bounds", report, async (page) => {
      const bound = (run) => rowOf(page, run).locator(".col-bound");
      assert.doesNotMatch(await bound(flown).innerText(), /model|continuous/);
      assert.match(await bound(plant).innerText(), /≤ 0\.02\s+of the plant in continuous time/);
      assert.match(await bound(flown).innerText(), /proved/);
      assert.match(await bound(model).innerText(), /≤ 1\.3\s+of the model/);
      assert.match(await bound(model).locator("[title]").first().getAttribute("title"), /does not cover what linearisation leaves out .* sampled/);
      assert.match(await rowOf(page, model).innerText(), /above the bound of the model/);
      assert.doesNotMatch(await rowOf(page, flown).innerText(), /above/);
    });
  });

  test("a missing premise and one that rests on itself are told, not followed", async () => {
    const report = makeReport({ duration_s: 2 });
    const run = report.runs.find((r) => r.id === "slpvqr-20");
    const cost = run.claims.find((claim) => claim.id === "cost");
    cost.premises = ["nowhere", "invariance"];
    run.claims.find((claim) => claim.id === "invariance").premises = ["cost"];
    await open("evidence-odd", report, async (page) => {
      const item = await itemInChecks(page, run, "cost");
      await item.locator(":scope > .chip-button").click();
      assert.match(await item.innerText(), /nowhere, of which nothing is known/);
      await item.locator('li[data-claim="invariance"] > .chip-button').click();
      assert.equal(await item.locator('li[data-claim="invariance"] li[data-claim="cost"] > .chip-button').count(), 0);
      assert.equal(await item.locator('li[data-claim="invariance"] li[data-claim="cost"] > .chip').count(), 1);
    });
  });

  test("a plant without a parameter has no column for its rate", async () => {
    await open("evidence-no-parameter", makeReport({ duration_s: 2, parameter: "" }), async (page) => {
      assert.equal(await page.locator(".col-rate").count(), 0);
      assert.doesNotMatch(await page.locator("#runs thead").innerText(), /Proved up to/);
      await badgeOf(page, { id: "slpvqr-20" }).click();
      assert.equal(await page.locator("#runs .evidence-row > td").evaluate((cell) => cell.colSpan), await page.locator("#runs thead th").count());
    });
  });

  test("the command is copied", async () => {
    const storage = { permissions: ["clipboard-read", "clipboard-write"] };
    await open("evidence-copy", makeReport({ duration_s: 2 }), async (page) => {
      await badgeOf(page, { id: "slpvqr-20" }).click();
      await panelOf(page).locator(":scope > .command button").click();
      await page.waitForFunction(() => /Copied/.test(document.querySelector(".evidence > .command button").textContent));
      assert.equal(await page.evaluate(() => navigator.clipboard.readText()), "lpv certify out/quadrotor/design-slpvqr-20.json");
    }, storage);
  });

  test("claims that do not fit the schema are named", async () => {
    const report = makeReport({ duration_s: 2 });
    const [first, second] = report.runs[4].claims;
    first.of = "model plant";
    first.premises = null;
    second.motion = { motion: "bounded" };
    delete report.runs[2].certify_command;
    const opened = await openReport(browser, await writePage("evidence-misfit", report), "desktop", "light");
    const text = await opened.page.locator("#load-error").innerText();
    for (const place of [/runs\[4\]\.claims\[0\]\.of: expected "model" or "plant"/, /runs\[4\]\.claims\[0\]\.premises: expected a list/, /runs\[4\]\.claims\[1\]\.motion\.rate: expected a number/, /runs\[2\]\.certify_command: expected a text/]) assert.match(text, place);
    await opened.close();
  });
});
