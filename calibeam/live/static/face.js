// One detector face, to scale: where the light is (disc), was (trail), and should be by the model (diamond).

import { COLOUR, Surface, font } from "./surface.js";
import { Trail } from "./trail.js";

const TRAIL_MS = 8000;
const EDGE = 0.8; // of the half side; beyond it the light is soon lost

const mm = (m) => `${m < 0 ? "−" : "+"}${Math.abs(1e3 * m).toFixed(3)}`;

export class FaceView {
  constructor(section) {
    this.surface = new Surface(section.querySelector("canvas"));
    this.state = section.querySelector(".state");
    this.cells = { x: section.querySelector(".x"), y: section.querySelector(".y"), sum: section.querySelector(".sum") };
    this.trail = new Trail(8 * 40, 2); // 30 Hz and some room
  }

  // face: of a message, or null: no fresh sample.
  hear(face, at_ms) {
    const lit = face && face.x_m !== null;
    this.trail.push(at_ms, lit ? [face.x_m, face.y_m] : [NaN, NaN]);
  }

  // dark_fits: by the model this face is to be dark now.
  draw(face, expected, half_m, at_ms, live, dark_fits = false) {
    const { surface } = this;
    const half = face?.half_m ?? half_m ?? 0.005;
    const missed = face?.state === "no light" && !dark_fits;
    this.say(face, half_m, live, missed);
    if (!surface.begin()) return;
    const size = Math.min(surface.width, surface.height);
    const scale = (size - 16) / (2 * half);
    const x = (m) => surface.width / 2 + m * scale;
    const y = (m) => surface.height / 2 - m * scale;
    this.grid(half, scale, x, y);
    this.path(at_ms, x, y);
    if (expected) this.diamond(expected, half, x, y);
    if (face && face.x_m !== null) this.disc(face, x, y, live);
    if (!live) surface.shout("OLD");
    else if (!face) surface.shout("NO SAMPLE\nsee Devices");
    else if (missed) surface.shout("NO LIGHT");
    else if (face.state === "no spot") surface.shout("NO SPOT\nlight beyond the map of the face", 18);
    else if (face.state === "saturated") surface.shout("TOO BRIGHT\nreduce laser or gain", 18);
  }

  say(face, half_m, live, missed) {
    const words = !live || !face ? "old" : face.state === "no light" && !missed ? "none" : face.state;
    const edge = face?.x_m != null && Math.max(Math.abs(face.x_m), Math.abs(face.y_m)) > EDGE * (face.half_m ?? half_m);
    const text = { old: "✕ no sample", light: edge ? "! near the edge" : "✓ light", saturated: "! saturated", "no light": "✕ no light", none: "no light expected", "no spot": "! no spot" }[words];
    set(this.state, text);
    const is = edge && words === "light" ? "edge" : words;
    if (this.state.dataset.is !== is) this.state.dataset.is = is;
    const shown = live && face?.x_m != null;
    set(this.cells.x, shown ? `x ${mm(face.x_m)}` : "x –");
    set(this.cells.y, shown ? `y ${mm(face.y_m)} mm` : "y –");
    set(this.cells.sum, live && face ? `${face.sum_v.toFixed(2)} V` : "– V");
  }

  grid(half, scale, x, y) {
    const { pen } = this.surface;
    const step = half > 0.012 ? 0.01 : half > 0.004 ? 0.005 : 0.001;
    pen.fillStyle = COLOUR.panel;
    pen.fillRect(x(-half), y(half), 2 * half * scale, 2 * half * scale);
    pen.lineWidth = 1;
    pen.strokeStyle = COLOUR.faint;
    pen.beginPath();
    for (let m = -Math.floor(half / step) * step; m <= half; m += step) {
      pen.moveTo(x(m), y(-half)); pen.lineTo(x(m), y(half));
      pen.moveTo(x(-half), y(m)); pen.lineTo(x(half), y(m));
    }
    pen.stroke();
    pen.strokeStyle = COLOUR.quiet;
    pen.beginPath();
    pen.moveTo(x(0), y(-half)); pen.lineTo(x(0), y(half)); pen.moveTo(x(-half), y(0)); pen.lineTo(x(half), y(0));
    pen.stroke();
    pen.lineWidth = 2;
    pen.strokeStyle = COLOUR.ink;
    pen.strokeRect(x(-half), y(half), 2 * half * scale, 2 * half * scale);
    this.ruler(step, half, scale, x, y);
  }

  ruler(step, half, scale, x, y) {
    const { pen } = this.surface;
    const left = x(-half) + 10, low = y(-half) - 10;
    pen.lineWidth = 3;
    pen.strokeStyle = pen.fillStyle = COLOUR.ink;
    pen.beginPath();
    pen.moveTo(left, low - 5); pen.lineTo(left, low); pen.lineTo(left + step * scale, low); pen.lineTo(left + step * scale, low - 5);
    pen.stroke();
    pen.font = font(14, 600);
    pen.textAlign = "left";
    pen.fillText(`${Math.round(1e3 * step)} mm`, left + 4, low - 8);
    pen.textAlign = "right";
    pen.fillText("x", x(half) - 6, y(0) - 6);
    pen.textAlign = "left";
    pen.fillText("y", x(0) + 6, y(half) + 15);
  }

  path(at_ms, x, y) {
    const { pen } = this.surface;
    let before = null;
    pen.lineCap = "butt";
    pen.strokeStyle = COLOUR.measured;
    this.trail.each(at_ms - TRAIL_MS, (then_ms, row) => {
      const here = [this.trail.values[2 * row], this.trail.values[2 * row + 1]];
      if (before && !Number.isNaN(here[0]) && !Number.isNaN(before[0])) {
        const young = 1 - (at_ms - then_ms) / TRAIL_MS;
        pen.globalAlpha = 0.15 + 0.65 * young;
        pen.lineWidth = 1 + 2.5 * young;
        pen.beginPath();
        pen.moveTo(x(before[0]), y(before[1])); pen.lineTo(x(here[0]), y(here[1]));
        pen.stroke();
      }
      before = here;
    });
    pen.globalAlpha = 1;
  }

  // Off the face: an arrow at its rim shows where to.
  diamond([x_m, y_m], half, x, y) {
    const { pen } = this.surface;
    const far = Math.max(Math.abs(x_m), Math.abs(y_m)) / half;
    const [px, py] = far > 1 ? [x(0.9 * x_m / far), y(0.9 * y_m / far)] : [x(x_m), y(y_m)];
    pen.save();
    pen.translate(px, py);
    pen.lineWidth = 3;
    pen.strokeStyle = COLOUR.model;
    pen.beginPath();
    if (far > 1) {
      pen.rotate(Math.atan2(-y_m, x_m));
      pen.moveTo(-12, -9); pen.lineTo(6, 0); pen.lineTo(-12, 9);
    } else {
      pen.moveTo(0, -13); pen.lineTo(13, 0); pen.lineTo(0, 13); pen.lineTo(-13, 0); pen.closePath();
    }
    pen.stroke();
    pen.restore();
  }

  disc(face, x, y, live) {
    const { pen } = this.surface;
    pen.beginPath();
    pen.arc(x(face.x_m), y(face.y_m), 7, 0, 2 * Math.PI);
    pen.fillStyle = live ? COLOUR.measured : COLOUR.panel;
    pen.fill();
    pen.lineWidth = 2.5;
    pen.strokeStyle = live ? COLOUR.panel : COLOUR.quiet;
    pen.stroke();
  }
}

function set(element, text) { if (element.textContent !== text) element.textContent = text; }
