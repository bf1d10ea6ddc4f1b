// Small pictures for points in the 3D view: one shape per run, so that runs differ without colour too.

import * as THREE from "three";
import type { Marker } from "./theme";

const SIZE = 64;
const cache = new Map<string, THREE.Texture>();

/** The shape in `color` with an edge in `edge`, on nothing. */
export function markerTexture(shape: Marker, color: string, edge: string): THREE.Texture {
  const key = `${shape} ${color} ${edge}`;
  const known = cache.get(key);
  if (known) return known;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE;
  const ctx = canvas.getContext("2d")!;
  ctx.translate(SIZE / 2, SIZE / 2);
  ctx.scale(SIZE / 2, SIZE / 2);
  ctx.lineJoin = "round";
  ctx.beginPath();
  outline(ctx, shape);
  const open = shape === "plus" || shape === "cross";
  for (const [style, extra] of [[edge, 0.22], [color, 0]] as const) {
    ctx.strokeStyle = style;
    ctx.fillStyle = shape === "ring" ? edge : style;
    ctx.lineWidth = (open ? 0.34 : shape === "ring" ? 0.26 : 0.06) + extra;
    if (!open) ctx.fill();
    ctx.stroke();
  }
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  cache.set(key, texture);
  return texture;
}

/** The shape's path in the square from −1 to 1. */
function outline(ctx: CanvasRenderingContext2D, shape: Marker): void {
  const polygon = (...points: [number, number][]): void => {
    points.forEach(([x, y], i) => (i === 0 ? ctx.moveTo(x, y) : ctx.lineTo(x, y)));
    ctx.closePath();
  };
  switch (shape) {
    case "circle":
      ctx.arc(0, 0, 0.66, 0, 2 * Math.PI);
      break;
    case "ring":
      ctx.arc(0, 0, 0.58, 0, 2 * Math.PI);
      break;
    case "square":
      ctx.rect(-0.6, -0.6, 1.2, 1.2);
      break;
    case "triangle":
      polygon([0, -0.78], [0.75, 0.55], [-0.75, 0.55]);
      break;
    case "down":
      polygon([0, 0.78], [0.75, -0.55], [-0.75, -0.55]);
      break;
    case "diamond":
      polygon([0, -0.84], [0.84, 0], [0, 0.84], [-0.84, 0]);
      break;
    case "plus":
      ctx.moveTo(-0.75, 0);
      ctx.lineTo(0.75, 0);
      ctx.moveTo(0, -0.75);
      ctx.lineTo(0, 0.75);
      break;
    case "cross":
      ctx.moveTo(-0.62, -0.62);
      ctx.lineTo(0.62, 0.62);
      ctx.moveTo(-0.62, 0.62);
      ctx.lineTo(0.62, -0.62);
      break;
  }
}
