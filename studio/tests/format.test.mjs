// The formatter of bounds, against what crates/lpv/src/math/decimal.rs writes.

import assert from "node:assert/strict";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

/** A module of the page, as the page has it. */
async function load(name) {
  const entry = fileURLToPath(new URL(`../src/${name}`, import.meta.url));
  const { outputFiles } = await build({ entryPoints: [entry], bundle: true, write: false, format: "esm", charset: "utf8" });
  return import(`data:text/javascript;charset=utf-8,${encodeURIComponent(outputFiles[0].text)}`);
}

const { decimal } = await load("decimal.ts");
const { atLeast, atMost, about, rateText } = await load("format.ts");

const down = (value) => decimal(value, 5, "down");
const up = (value) => decimal(value, 5, "up");
const nearest = (value) => decimal(value, 5, "nearest");

/** The double beside `value`, away from zero or towards it. */
function beside(value, ulps) {
  const bits = new DataView(new ArrayBuffer(8));
  bits.setFloat64(0, value);
  bits.setBigUint64(0, bits.getBigUint64(0) + BigInt(ulps));
  return bits.getFloat64(0);
}

test("reads as an engineer writes", () => {
  const vectors = [[2, "2"], [9.807, "9.807"], [1e-12, "1e-12"], [123456789, "1.2346e8"], [0.00012345, "0.00012345"], [-1234567, "-1234600"], [0, "0"], [-0, "0"], [Infinity, "inf"]];
  for (const [value, text] of vectors) assert.equal(nearest(value), text);
});

test("errs to the safe side", () => {
  assert.equal(down(5.34836), "5.3483");
  assert.equal(up(5.34836), "5.3484");
  assert.equal(up(-5.34836), "-5.3483");
  assert.equal(down(-5.34836), "-5.3484");
  assert.equal(up(0.99999999), "1");
  for (const value of [0.1, 1e-8, 0.3, 2, 9.807]) assert.equal(down(value), up(value), "a short decimal is the double that it is read as");
  assert.deepEqual([down(0.1), up(1e-8)], ["0.1", "1e-8"]);
  assert.deepEqual([down(beside(0.1, -1)), up(beside(0.1, 1))], ["0.099999", "0.10001"]);
  assert.equal(down(Number.MAX_VALUE), "1.7976e308");
  assert.notEqual(Number(down(5e-324)), 0);
  assert.notEqual(down(5e-324), "0");
});

test("the side is kept, whatever the double", () => {
  // a linear congruential generator over all bit patterns
  let word = 88172645463325252n;
  const bits = new DataView(new ArrayBuffer(8));
  let count = 0;
  for (let k = 0; k < 20000; k++) {
    word = BigInt.asUintN(64, word * 6364136223846793005n + 1442695040888963407n);
    bits.setBigUint64(0, word);
    const value = bits.getFloat64(0);
    if (!Number.isFinite(value) || Math.abs(value) < 1e-290 || Math.abs(value) > 1e290) continue;
    const [low, high] = [Number(down(value)), Number(up(value))];
    assert.ok(low <= value && value <= high, `${low} ${value} ${high}`);
    assert.ok(Math.abs(high - low) <= 1.001e-4 * Math.abs(value));
    assert.ok(low !== 0 && high !== 0);
    count++;
  }
  assert.ok(count > 15000);
  for (let k = 1; k < 100000; k += 7) {
    // numbers that are decimals already, and their neighbours
    const value = k / 1e4;
    assert.equal(Number(down(value)) <= value && value <= Number(up(value)), true, String(value));
    assert.ok(Number(up(beside(value, 1))) >= beside(value, 1) && Number(down(beside(value, -1))) <= beside(value, -1));
  }
});

test("is set as a reader expects it", () => {
  assert.equal(atLeast(1.23456e-8), "1.2345\u202f×\u202f10⁻⁸");
  assert.equal(atMost(-5.34836), "−5.3483");
  assert.equal(about(1.234567e8), "1.2346\u202f×\u202f10⁸");
  assert.deepEqual([atLeast(Infinity), atMost(-Infinity), about(NaN)], ["∞", "−∞", "–"]);
  assert.equal(rateText("psi"), "|ψ̇|");
  assert.equal(rateText("rho_1"), "|dρ 1/dt|");
});
