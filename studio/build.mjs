// Builds dist/report.html: one HTML file with the style and the script inside, and one place for the data.
//
// The file is a function of the sources and the locked packages alone: no dates, no paths, no host names.

import { mkdir, readFile, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const root = fileURLToPath(new URL(".", import.meta.url));
const PLACEHOLDER = "/*LPV_REPORT_DATA*/";
const STYLE_SLOT = "/*STYLE*/";
const SCRIPT_SLOT = "/*SCRIPT*/";
const LICENSE_SLOT = "LICENSES";

/** The licence texts of what is inlined: both ask to be carried along. */
async function licenses() {
  const parts = await Promise.all(
    ["three", "uplot"].map(async (name) => `${name}\n\n${(await readFile(`${root}node_modules/${name}/LICENSE`, "utf8")).trim()}`),
  );
  return parts.join("\n\n").replaceAll("\r", "").replaceAll("--", "- -");
}

/** Bundles one entry point in memory and returns its text. */
async function bundle(entry) {
  const result = await build({
    entryPoints: [`${root}src/${entry}`],
    absWorkingDir: root,
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2022",
    charset: "utf8",
    legalComments: "none",
    logLevel: "warning",
  });
  return result.outputFiles[0].text.trim();
}

/** Fills one slot, which must be there exactly once; `$` in the text is taken literally. */
function fill(html, slot, text) {
  if (html.split(slot).length !== 2) throw new Error(`index.html must contain ${slot} exactly once`);
  return html.replace(slot, () => text);
}

const [template, script, style, notices] = await Promise.all([
  readFile(`${root}src/index.html`, "utf8"),
  bundle("main.ts"),
  bundle("style.css"),
  licenses(),
]);

for (const [name, text] of [["script", script], ["style", style], ["licences", notices]]) {
  for (const forbidden of [PLACEHOLDER, "</script", "</style", "<!--"]) {
    if (text.includes(forbidden)) throw new Error(`the ${name} contains ${forbidden}, which would break the page that it is put into`);
  }
}

let html = fill(template, LICENSE_SLOT, notices);
html = fill(html, STYLE_SLOT, style);
html = fill(html, SCRIPT_SLOT, script);
if (html.split(PLACEHOLDER).length !== 2) throw new Error(`the page must contain ${PLACEHOLDER} exactly once`);

await mkdir(`${root}dist`, { recursive: true });
await writeFile(`${root}dist/report.html`, html);
console.log(`dist/report.html: ${Buffer.byteLength(html)} bytes (script ${script.length}, style ${style.length})`);
