// Reads PNG screenshots: 8-bit RGB or RGBA, not interlaced, which is what the browser writes.

import { inflateSync } from "node:zlib";

/** Decodes to `{ width, height, pixel(x, y) -> [r, g, b] }`. */
export function decodePng(bytes) {
  let width = 0;
  let height = 0;
  let channels = 0;
  const parts = [];
  for (let at = 8; at < bytes.length; ) {
    const length = bytes.readUInt32BE(at);
    const type = bytes.toString("latin1", at + 4, at + 8);
    const body = bytes.subarray(at + 8, at + 8 + length);
    if (type === "IHDR") {
      width = body.readUInt32BE(0);
      height = body.readUInt32BE(4);
      if (body[8] !== 8 || ![2, 6].includes(body[9]) || body[12] !== 0) throw new Error("only 8-bit RGB or RGBA PNG without interlace");
      channels = body[9] === 2 ? 3 : 4;
    } else if (type === "IDAT") parts.push(body);
    at += length + 12;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const data = Buffer.alloc(stride * height);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (stride + 1)];
    const row = y * stride;
    for (let i = 0; i < stride; i++) {
      const left = i >= channels ? data[row + i - channels] : 0;
      const up = y > 0 ? data[row - stride + i] : 0;
      const corner = y > 0 && i >= channels ? data[row - stride + i - channels] : 0;
      const guess = [0, left, up, (left + up) >> 1, paeth(left, up, corner)][filter];
      data[row + i] = (raw[y * (stride + 1) + 1 + i] + guess) & 255;
    }
  }
  return { width, height, pixel: (x, y) => [...data.subarray((y * width + x) * channels, (y * width + x) * channels + 3)] };
}

function paeth(a, b, c) {
  const p = a + b - c;
  const [pa, pb, pc] = [Math.abs(p - a), Math.abs(p - b), Math.abs(p - c)];
  return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
}

/** How many different colours a picture has, at 4 bits a channel, each on at least `least` pixels. */
export function countColors(png, least = 4) {
  const seen = new Map();
  for (let y = 0; y < png.height; y++) {
    for (let x = 0; x < png.width; x++) {
      const [r, g, b] = png.pixel(x, y);
      const key = ((r >> 4) << 8) | ((g >> 4) << 4) | (b >> 4);
      seen.set(key, (seen.get(key) ?? 0) + 1);
    }
  }
  return [...seen.values()].filter((n) => n >= least).length;
}

/** Share of the pixels in which two pictures of one size differ. */
export function difference(a, b) {
  if (a.width !== b.width || a.height !== b.height) throw new Error("the pictures differ in size");
  let count = 0;
  for (let y = 0; y < a.height; y++) {
    for (let x = 0; x < a.width; x++) {
      const [p, q] = [a.pixel(x, y), b.pixel(x, y)];
      if (p.some((v, i) => Math.abs(v - q[i]) > 24)) count++;
    }
  }
  return count / (a.width * a.height);
}
