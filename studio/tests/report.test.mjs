// The report page in a real browser: on a desktop and a phone, in light and dark.
//
// LPV_REPORT=/path/to/report.html tests a report of the program; otherwise one is made from tests/fixture.mjs.

import assert from "node:assert/strict";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { resolve } from "node:path";
import { after, before, describe, test } from "node:test";
import { fileURLToPath } from "node:url";
import { openReport, scrubTo, settle, startBrowser } from "./browser.mjs";
import { fillPage, makeReport } from "./fixture.mjs";
import { countColors, decodePng, difference } from "./png.mjs";

const root = fileURLToPath(new URL("..", import.meta.url));
const output = `${root}test-output/`;
const LIMIT = { timeout: 180_000 };

let template;
let browser;

/** Writes a page with these data and returns its path. */
async function writePage(name, report) {
  const file = `${output}${name}.html`;
  await writeFile(file, fillPage(template, report));
  return file;
}

async function dataOf(page) {
  return page.evaluate(() => JSON.parse(document.getElementById("report-data").textContent));
}

async function picture(locator) {
  return decodePng(await locator.screenshot());
}

before(async () => {
  await mkdir(output, { recursive: true });
  template = await readFile(`${root}dist/report.html`, "utf8").catch(() => {
    throw new Error("dist/report.html is missing: run `npm run build` first");
  });
  browser = await startBrowser();
});

after(() => browser?.close());

test("the template has one place for the data and closes no element early", () => {
  assert.equal(template.split("/*LPV_REPORT_DATA*/").length, 2);
  assert.equal(template.match(/<\/script/g).length, 2);
  assert.doesNotMatch(template, /(src|href)="(?!data:)/);
});

for (const screen of ["desktop", "phone"]) {
  for (const mode of ["light", "dark"]) {
    describe(`${screen}, ${mode}`, LIMIT, () => {
      let opened;
      let report;

      before(async () => {
        const file = process.env.LPV_REPORT ? resolve(process.env.LPV_REPORT) : await writePage("fixture", makeReport());
        opened = await openReport(browser, file, screen, mode);
        report = await dataOf(opened.page);
        await opened.page.screenshot({ path: `${output}${screen}-${mode}.png` });
      });

      after(async () => {
        await opened.close();
      });

      test("follows the system's light or dark", async () => {
        assert.equal(await opened.page.evaluate(() => document.documentElement.dataset.theme), mode);
      });

      test("the table has a row for each run and no bound without a verdict", async () => {
        const rows = opened.page.locator("#runs tbody tr[data-run]");
        assert.equal(await rows.count(), report.runs.length);
        for (const [i, run] of report.runs.entries()) {
          const text = await rows.nth(i).innerText();
          assert.ok(text.includes(run.label), `row ${i} names ${run.label}`);
          const bound = await rows.nth(i).locator(".col-bound").innerText();
          const has = run.guaranteed_cost ?? run.plant_cost_bound ?? run.model_cost_bound;
          if (has !== null) assert.ok(bound.includes(run.guaranteed_cost_verdict), `the bound of ${run.label} shows its verdict`);
          assert.equal(/of the model/.test(bound.split("\n").slice(0, 2).join(" ")), run.model_cost_bound !== null, `the bound of ${run.label} names what it bounds`);
          if (run.outcome.kind === "diverged") assert.match(text, /diverged at/);
        }
      });

      test("the 3D view shows vehicles and changes with time", async (t) => {
        if (!report.plant.scene) return t.skip("this plant has no scene");
        const { page } = opened;
        const view = page.locator(".scene-view");
        await view.scrollIntoViewIfNeeded();
        const [start, end] = [report.time[0], report.time.at(-1)];
        await scrubTo(page, start);
        const first = await picture(view);
        await scrubTo(page, start + 0.4 * (end - start));
        const second = await picture(view);
        await page.screenshot({ path: `${output}${screen}-${mode}-scene.png` });
        assert.ok(countColors(second) >= 12, `${countColors(second)} colours`);
        assert.ok(difference(first, second) > 0.003, `${difference(first, second)} of the pixels changed`);
      });

      test("each plot draws something", async () => {
        const { page } = opened;
        await page.evaluate(() => document.querySelectorAll("details").forEach((d) => (d.open = true)));
        const plots = page.locator(".plot");
        assert.ok((await plots.count()) >= 4);
        for (let i = 0; i < (await plots.count()); i++) {
          await plots.nth(i).scrollIntoViewIfNeeded();
          await settle(page);
          const drawn = await plots.nth(i).locator("canvas").evaluate((canvas) => {
            const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            const colors = new Set();
            for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 200) colors.add(((data[k] >> 5) << 6) | ((data[k + 1] >> 5) << 3) | (data[k + 2] >> 5));
            return colors.size;
          });
          assert.ok(drawn >= 3, `${await plots.nth(i).getAttribute("data-plot")} has ${drawn} colours`);
        }
      });

      test("a scrub moves the clock everywhere", async () => {
        const { page } = opened;
        const plot = page.locator(".plot").first();
        await plot.scrollIntoViewIfNeeded();
        const at = async (t) => {
          await scrubTo(page, t);
          return {
            bar: await page.locator("#time").innerText(),
            plots: await page.locator("#plots-time").innerText(),
            scene: report.plant.scene ? await page.locator("#scene-time").innerText() : null,
            line: await plot.locator(".now-line").evaluate((n) => n.getBoundingClientRect().left),
          };
        };
        // on the slider's steps, a hundredth of a second
        const [early, late] = [0.25, 0.75].map((share) => Math.round(100 * share * report.time.at(-1)) / 100);
        const [a, b] = [await at(early), await at(late)];
        assert.match(b.plots, new RegExp(late.toFixed(2).replace(".", "\\.")));
        for (const key of Object.keys(a)) if (a[key] !== null) assert.notEqual(a[key], b[key], key);
        assert.ok(b.line > a.line + 40);
      });

      test("nothing is wider than the page", async () => {
        const [content, width] = await opened.page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
        assert.ok(content <= width, `${content} > ${width}`);
      });

      test("hiding a run takes it from the plots and comes back", async () => {
        const { page } = opened;
        const box = page.locator("#runs input[type=checkbox]").first();
        await box.uncheck();
        assert.equal(await page.locator(".legend-item").first().getAttribute("aria-pressed"), "false");
        await box.check();
        assert.equal(await page.locator(".legend-item").first().getAttribute("aria-pressed"), "true");
      });

      test("sends no request and makes no complaint", async () => {
        assert.deepEqual(opened.strayRequests, []);
        assert.deepEqual(opened.complaints, []);
      });
    });
  }
}

describe("on a desktop", LIMIT, () => {
  let opened;

  before(async () => {
    opened = await openReport(browser, await writePage("fixture", makeReport()), "desktop", "light");
  });

  after(() => opened.close());

  test("a drag in one plot zooms all, a double click resets", async () => {
    const { page } = opened;
    const over = page.locator('.plot[data-plot="state-4"] .u-over');
    await over.scrollIntoViewIfNeeded();
    await settle(page);
    const box = await over.boundingBox();
    const now = () => page.locator('.plot[data-plot="state-5"] .now-line').evaluate((n) => n.style.transform + n.hidden);
    await scrubTo(page, 10);
    const before = await now();
    await page.mouse.move(box.x + 0.1 * box.width, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.5 * box.width, box.y + 40, { steps: 6 });
    await page.mouse.up();
    await page.mouse.move(5, 5);
    await settle(page);
    assert.ok(await page.locator("#reset-zoom").isVisible());
    assert.notEqual(await now(), before);
    await over.dblclick();
    await page.mouse.move(5, 5);
    await settle(page);
    assert.ok(!(await page.locator("#reset-zoom").isVisible()));
  });

  test("hovering previews a time, a click sets it", async () => {
    const { page } = opened;
    const over = page.locator('.plot[data-plot="state-3"] .u-over');
    await over.scrollIntoViewIfNeeded();
    await scrubTo(page, 3);
    const box = await over.boundingBox();
    const time = () => page.locator("#scene-time").innerText();
    await page.mouse.move(box.x + 0.6 * box.width, box.y + 50);
    await settle(page);
    assert.notEqual(await time(), "t = 3.00 s");
    await page.mouse.move(5, 5);
    await settle(page);
    assert.equal(await time(), "t = 3.00 s");
    await page.mouse.click(box.x + 0.6 * box.width, box.y + 50);
    await page.mouse.move(5, 5);
    await settle(page);
    assert.notEqual(await time(), "t = 3.00 s");
  });

  test("space plays and pauses; the clock moves", async () => {
    const { page } = opened;
    await scrubTo(page, 5);
    await page.locator("body").press(" ");
    await page.waitForTimeout(700);
    await page.locator("body").press(" ");
    const text = await page.locator("#time").innerText();
    assert.ok(Number.parseFloat(text) > 5.05, text);
    await settle(page);
    assert.equal(await page.locator("#time").innerText(), text);
  });

  test("the theme button switches and is heard by all", async () => {
    const { page } = opened;
    await page.locator(".page-header .icon-button").click();
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
    await page.locator(".page-header .icon-button").click();
  });
});

describe("odd data", LIMIT, () => {
  const open = async (name, report, use) => {
    const opened = await openReport(browser, await writePage(name, report), "desktop", "light");
    await use(opened.page);
    await opened.page.screenshot({ path: `${output}${name}.png` });
    assert.deepEqual(opened.complaints, []);
    await opened.close();
  };

  test("a plant without a scene and runs without estimation", async () => {
    await open("no-scene", makeReport({ scene: false, estimation: false, duration_s: 12 }), async (page) => {
      assert.equal(await page.locator("#scene").count(), 0);
      assert.equal(await page.locator("#plots-estimation").count(), 0);
      assert.ok((await page.locator(".plot").count()) > 8);
    });
  });

  test("a flight over a hundred metres draws larger vehicles and says so", async () => {
    await open("wide", makeReport({ scale: 20, duration_s: 45 }), async (page) => {
      assert.match(await page.locator("#scene-scale").innerText(), /×\d+/);
    });
  });

  test("data that do not fit the schema are named, one by one", async () => {
    const report = makeReport({ duration_s: 2 });
    report.runs[1].states[4].pop();
    report.runs[0].verdict = "sure";
    await open("misfit", report, async (page) => {
      const text = await page.locator("#load-error").innerText();
      assert.match(text, /runs\[1\]\.states\[4\]: expected a list of length/);
      assert.match(text, /runs\[0\]\.verdict: expected one of proved/);
    });
  });

  test("the empty template says that it is empty", async () => {
    const opened = await openReport(browser, `${root}dist/report.html`, "desktop", "light");
    assert.match(await opened.page.locator("#load-error").innerText(), /empty template/);
    await opened.close();
  });

  test("without WebGL the rest works", async () => {
    const plain = await startBrowser(["--disable-3d-apis"]);
    const opened = await openReport(plain, await writePage("fixture", makeReport()), "desktop", "light");
    assert.match(await opened.page.locator("#scene").innerText(), /No 3D view/);
    await opened.page.screenshot({ path: `${output}no-webgl.png` });
    await opened.page.locator(".plot").first().scrollIntoViewIfNeeded();
    await settle(opened.page);
    assert.ok((await opened.page.locator(".plot canvas").count()) > 0);
    await opened.close();
    await plain.close();
  });
});
