// Starts the browser of the machine, and opens reports in it while watching what they do.

import { existsSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const BROWSER = process.env.CHROMIUM ?? "/usr/bin/chromium";

/** WebGL in software, and a browser that keeps to itself. */
const FLAGS = [
  "--no-sandbox",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

export async function startBrowser(flags = []) {
  if (!existsSync(BROWSER)) {
    throw new Error(`No browser at ${BROWSER}. Install one (Debian: apt-get install chromium), or name it: CHROMIUM=/path/to/chromium npm test`);
  }
  return chromium.launch({ executablePath: BROWSER, args: [...FLAGS, ...flags] });
}

export const SCREENS = {
  desktop: { viewport: { width: 1440, height: 900 } },
  phone: { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 },
};

/** Opens a file; `strayRequests` and `complaints` fill with what it should not do. */
export async function openReport(browser, file, screen, colorScheme, storage) {
  const context = await browser.newContext({ ...SCREENS[screen], colorScheme, reducedMotion: "reduce", ...storage });
  const page = await context.newPage();
  const url = pathToFileURL(file).href;
  const strayRequests = [];
  const complaints = [];
  page.on("request", (r) => {
    if (r.url() !== url && !r.url().startsWith("data:") && !r.url().startsWith("blob:")) strayRequests.push(r.url());
  });
  page.on("console", (m) => {
    if (m.type() === "error") complaints.push(m.text());
  });
  page.on("pageerror", (e) => complaints.push(e.message));
  await page.goto(url);
  await settle(page);
  return { page, strayRequests, complaints, close: () => context.close() };
}

/** Waits until what was asked for is drawn. */
export async function settle(page) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 150)))));
}

/** Moves the clock as a hand on the slider does. */
export async function scrubTo(page, time) {
  await page.locator("#scrub").evaluate((input, t) => {
    input.value = String(t);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, time);
  await settle(page);
}
