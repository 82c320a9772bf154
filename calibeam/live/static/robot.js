// The robot, its laser beam and both faces, from the points that the model gives; no mesh, so any arm is drawn.

import { Orbit } from "./orbit.js";
import { COLOUR, Surface, font } from "./surface.js";

const ROOM = { beam: 0.6, arm: 0.51 }; // from the middle of the picture to its rim, of the diagonal of what is looked at
const THICK = 0.09; // of the reach: links and their shadow about the points
const VIEWS = { whole: [-0.9, 0.42], top: [0, 1.5], side: [0, 0.02] };

export class RobotView {
  constructor(canvas, buttons, changed) {
    this.surface = new Surface(canvas);
    this.orbit = new Orbit(canvas, changed);
    this.changed = changed;
    this.follow = false;
    this.buttons = [...buttons];
    for (const button of this.buttons) button.addEventListener("click", () => this.view(button.dataset.view));
    this.pressed("whole");
  }

  // The rig is known: how large a picture it takes.
  fit(reach_m) {
    this.reach_m = reach_m;
    this.view("whole");
  }

  view(name) {
    const { orbit } = this;
    this.follow = name === "beam";
    if (!this.follow) {
      [orbit.yaw, orbit.pitch] = VIEWS[name];
      this.box = null;
    }
    orbit.zoom = 1;
    this.pressed(name);
    this.changed();
  }

  pressed(name) {
    for (const button of this.buttons) button.setAttribute("aria-pressed", String(button.dataset.view === name));
  }

  draw(now, standing, live) {
    const { surface, orbit } = this;
    if (!surface.begin()) return;
    if (this.follow) this.aim(now, standing);
    else this.enclose(now, standing);
    const at = orbit.lens(surface.width, surface.height);
    this.floor(at);
    if (now?.points_m) {
      if (!this.follow) this.shadow(now.points_m, at);
      for (const part of this.parts(now, standing, at).sort((a, b) => b.depth - a.depth)) part.draw();
      if (now.beam) this.beam(now.beam.points_m, at);
      if (standing) this.names(standing, at);
    } else if (standing) this.faces(standing, at).forEach((part) => part.draw());
    if (!live) surface.shout("OLD");
    else if (now && !now.points_m) surface.shout("NO JOINT READINGS\nsee Devices");
  }

  // On the faces and the laser, whatever moves.
  aim(now, standing) {
    const beam = now?.beam?.points_m ?? [];
    const corners = standing ? standing.corners_m.flat() : [];
    const points = corners.length && beam.length === 2 ? [beam[0], ...corners] : [...beam, ...corners];
    if (points.length) this.look(around(points), ROOM.beam);
  }

  // All that the arm has reached since the view was chosen: it never leaves the picture, nor pulls it about.
  enclose(now, standing) {
    if (!now?.points_m) return;
    const points = [...now.points_m, [0, 0, 0], ...(standing ? standing.corners_m.flat() : [])];
    const box = around(this.box ? [...points, ...this.box] : points);
    if (this.box && box.every((corner, end) => corner.every((value, k) => value === this.box[end][k]))) return;
    this.box = box;
    this.look(box, ROOM.arm, THICK * (this.reach_m ?? 1));
  }

  // `margin_m` about the box: what is drawn round its points.
  look([low, high], room, margin_m = 0) {
    this.orbit.middle = low.map((value, k) => (value + high[k]) / 2);
    this.orbit.size_m = room * Math.max(0.05, Math.hypot(...high.map((value, k) => value - low[k]))) + margin_m;
  }

  names(standing, at) {
    const { pen } = this.surface;
    pen.font = font(15, 700);
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    standing.corners_m.forEach((corners, k) => {
      const seen = corners.map(at), right = Math.max(...seen.map((p) => p[0])) + 8;
      const y = seen.reduce((sum, p) => sum + p[1], 0) / 4;
      pen.lineWidth = 4;
      pen.strokeStyle = COLOUR.panel;
      pen.strokeText(`PSD ${k + 1}`, right, y);
      pen.fillStyle = COLOUR.ink;
      pen.fillText(`PSD ${k + 1}`, right, y);
    });
    pen.textBaseline = "alphabetic";
  }

  floor(at) {
    const { pen } = this.surface;
    const reach = this.reach_m ?? 1, step = reach > 0.6 ? 0.25 : 0.1, half = Math.ceil(0.9 * reach / step) * step;
    pen.lineWidth = 1;
    pen.strokeStyle = COLOUR.faint;
    pen.beginPath();
    for (let m = -half; m <= half + 1e-9; m += step) {
      line(pen, at([m, -half, 0]), at([m, half, 0]));
      line(pen, at([-half, m, 0]), at([half, m, 0]));
    }
    pen.stroke();
    this.axes(at, step);
  }

  axes(at, step) {
    const { pen } = this.surface;
    pen.font = font(14, 700);
    pen.textAlign = "center";
    pen.lineWidth = 2;
    pen.strokeStyle = pen.fillStyle = COLOUR.quiet;
    for (const [name, end] of [["x", [step, 0, 0]], ["y", [0, step, 0]]]) {
      const tip = at(end);
      pen.beginPath();
      line(pen, at([0, 0, 0]), tip);
      pen.stroke();
      pen.fillText(name, tip[0] + 8, tip[1] + 12);
    }
  }

  shadow(points, at) {
    const { pen } = this.surface;
    pen.strokeStyle = COLOUR.shadow;
    pen.lineCap = pen.lineJoin = "round";
    pen.lineWidth = 0.07 * (this.reach_m ?? 1) * at([0, 0, 0])[3];
    pen.beginPath();
    points.forEach(([x, y], k) => { const p = at([x, y, 0]); if (k) pen.lineTo(p[0], p[1]); else pen.moveTo(p[0], p[1]); });
    pen.stroke();
  }

  // Links as rods, joints as discs; thinner towards the flange, as arms are.
  parts(now, standing, at) {
    const { pen } = this.surface;
    const reach = this.reach_m ?? 1, seen = now.points_m.map(at), count = seen.length - 1;
    const wide = (k, scale) => Math.max(4, reach * (0.062 - 0.03 * k / count) * scale);
    const parts = [];
    for (let k = 0; k < count; k += 1) {
      const [a, b] = [seen[k], seen[k + 1]];
      const width = wide(k, (a[3] + b[3]) / 2);
      parts.push({ depth: (a[2] + b[2]) / 2 + 1e-3, draw: () => rod(pen, a, b, width) });
      parts.push({ depth: a[2] - 0.6 * width / a[3], draw: () => disc(pen, a, 0.62 * width) });
    }
    const flange = seen[count];
    parts.push({ depth: flange[2] - 0.01, draw: () => disc(pen, flange, 0.5 * wide(count, flange[3])) });
    if (now.beam) {
      const laser = at(now.beam.points_m[0]);
      parts.push({ depth: laser[2], draw: () => rod(pen, flange, laser, 0.35 * wide(count, laser[3])) });
    }
    return [...parts, ...(standing ? this.faces(standing, at) : [])];
  }

  faces(standing, at) {
    const { pen } = this.surface;
    return standing.corners_m.map((corners) => {
      const seen = corners.map(at);
      return { depth: seen.reduce((sum, p) => sum + p[2], 0) / 4, draw: () => face(pen, seen) };
    });
  }

  beam(points, at) {
    const { pen } = this.surface;
    const seen = points.map(at);
    for (const [width, colour] of [[7, COLOUR.halo], [3, COLOUR.beam]]) {
      pen.lineWidth = width;
      pen.strokeStyle = colour;
      pen.lineCap = pen.lineJoin = "round";
      pen.setLineDash(points.length === 2 && width === 3 ? [12, 8] : []);
      pen.beginPath();
      seen.forEach(([x, y], k) => { if (k) pen.lineTo(x, y); else pen.moveTo(x, y); });
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.fillStyle = COLOUR.beam;
    if (points.length > 2) for (const [x, y] of seen.slice(1)) { pen.beginPath(); pen.arc(x, y, 4.5, 0, 2 * Math.PI); pen.fill(); }
  }
}

// Lowest and highest corner of the box around points.
function around(points) {
  return [Math.min, Math.max].map((end) => [0, 1, 2].map((k) => end(...points.map((p) => p[k]))));
}

function line(pen, a, b) { pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); }

function rod(pen, a, b, width) {
  pen.lineCap = "round";
  for (const [share, colour] of [[1, "#20272e"], [0.78, "#aeb8c1"], [0.3, "#dfe5ea"]]) {
    pen.lineWidth = share * width;
    pen.strokeStyle = colour;
    pen.beginPath();
    line(pen, a, b);
    pen.stroke();
  }
}

function disc(pen, at, radius) {
  pen.beginPath();
  pen.arc(at[0], at[1], Math.max(3, radius), 0, 2 * Math.PI);
  pen.fillStyle = "#5b6671";
  pen.fill();
  pen.lineWidth = 1.5;
  pen.strokeStyle = "#20272e";
  pen.stroke();
}

function face(pen, seen) {
  pen.beginPath();
  seen.forEach(([x, y], k) => { if (k) pen.lineTo(x, y); else pen.moveTo(x, y); });
  pen.closePath();
  pen.fillStyle = "#f0d264cc";
  pen.fill();
  pen.lineWidth = 2;
  pen.strokeStyle = COLOUR.ink;
  pen.stroke();
}
