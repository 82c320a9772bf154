// A strip for each joint: all since the page opened, at most the last minute, each to its own scale; its reading in large.

import { COLOUR, Surface, font } from "./surface.js";
import { Trail } from "./trail.js";

const SPAN_MS = 60000;
const LEAST_SPAN_MS = 2000;
const EVERY_MS = 100;
const LEAST_DEG = 0.02; // of a strip's height: noise of a joint that stands must not fill it

export class JointsView {
  constructor(canvas) {
    this.surface = new Surface(canvas);
    this.trail = null;
    this.pushed_ms = -Infinity;
    this.began_ms = null;
  }

  // What a strip is wide: it is full from the first seconds on.
  span_ms(at_ms) {
    return Math.min(SPAN_MS, Math.max(LEAST_SPAN_MS, at_ms - (this.began_ms ?? at_ms)));
  }

  hear(q_rad, at_ms, joints) {
    if (!this.trail || this.trail.width !== joints) this.trail = new Trail(SPAN_MS / EVERY_MS + 20, joints);
    if (at_ms - this.pushed_ms < EVERY_MS) return;
    this.pushed_ms = at_ms;
    this.began_ms ??= at_ms;
    this.trail.push(at_ms, q_rad ? q_rad.map((q) => (q === null ? NaN : q * 180 / Math.PI)) : []);
  }

  draw(q_rad, at_ms, live) {
    const { surface } = this;
    if (!this.trail || !surface.begin()) return;
    const rows = this.trail.width, high = surface.height / rows;
    for (let joint = 0; joint < rows; joint += 1) {
      this.strip(joint, joint * high, high, at_ms);
      this.label(joint, joint * high, high, live && q_rad ? q_rad[joint] : null);
    }
    if (!live) surface.shout("OLD");
  }

  label(joint, top, high, q) {
    const { pen } = this.surface;
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    pen.fillStyle = COLOUR.ink;
    pen.font = font(15, 700);
    pen.fillText(`J${joint + 1}`, 0, top + high / 2);
    pen.textAlign = "right";
    pen.font = font(17, 600);
    pen.fillText(q === null || q === undefined ? "–" : `${(q * 180 / Math.PI).toFixed(2)}°`.replace("-", "−"), 118, top + high / 2);
    pen.textBaseline = "alphabetic";
  }

  strip(joint, top, high, at_ms) {
    const { pen, width } = this.surface;
    const left = 128, wide = width - left - 2, { trail } = this, span_ms = this.span_ms(at_ms);
    let low = Infinity, peak = -Infinity;
    const value = (row) => trail.values[row * trail.width + joint];
    trail.each(at_ms - span_ms, (_, row) => { const v = value(row); if (v < low) low = v; if (v > peak) peak = v; });
    pen.strokeStyle = COLOUR.faint;
    pen.lineWidth = 1;
    pen.strokeRect(left, top + 3, wide, high - 6);
    if (!(peak >= low)) return;
    const middle = (low + peak) / 2, span = Math.max(LEAST_DEG, 1.15 * (peak - low));
    pen.strokeStyle = COLOUR.measured;
    pen.lineWidth = 2;
    pen.lineJoin = "round";
    pen.beginPath();
    let drawing = false;
    trail.each(at_ms - span_ms, (then_ms, row) => {
      const v = value(row);
      if (Number.isNaN(v)) { drawing = false; return; }
      const x = left + wide * (1 - (at_ms - then_ms) / span_ms), y = top + high / 2 - (v - middle) / span * (high - 12);
      if (drawing) pen.lineTo(x, y); else pen.moveTo(x, y);
      drawing = true;
    });
    pen.stroke();
    pen.fillStyle = COLOUR.quiet;
    pen.font = font(12);
    pen.textAlign = "left";
    pen.fillText(`${span >= 10 ? span.toFixed(0) : span.toPrecision(2)}° high`, left + 5, top + high - 8);
  }
}
