// From points of the base (m) to the screen: a camera on an orbit, moved by drag, wheel and pinch.

const FAR = 6; // how many times the pictured size the camera is away: little perspective, yet depth is seen

export class Orbit {
  constructor(canvas, changed) {
    this.yaw = -0.9;
    this.pitch = 0.42;
    this.zoom = 1;
    this.middle = [0, 0, 0.3];
    this.size_m = 1;
    this.changed = changed;
    this.fingers = new Map();
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); this.fingers.set(event.pointerId, event); });
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.fingers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.nearer(Math.exp(-event.deltaY / 600)); }, { passive: false });
  }

  moved(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    if (this.fingers.size === 2) {
      const other = [...this.fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      const span = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
      this.nearer(span(event) / Math.max(span(before), 1));
    } else {
      this.yaw -= (event.clientX - before.clientX) / 150;
      this.pitch = clamp(this.pitch + (event.clientY - before.clientY) / 150, -1.5, 1.5);
      this.changed();
    }
    this.fingers.set(event.pointerId, event);
  }

  nearer(factor) {
    this.zoom = clamp(this.zoom * factor, 0.3, 40);
    this.changed();
  }

  // For one picture of this size (CSS pixels): point -> [x, y, depth], depth larger farther away.
  lens(width, height) {
    const scale = this.zoom * Math.min(width, height) / (2 * this.size_m);
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const [mx, my, mz] = this.middle;
    const away = FAR * this.size_m / this.zoom;
    return ([px, py, pz]) => {
      const [x, y, z] = [px - mx, py - my, pz - mz];
      const right = cy * x + sy * y, into = -sy * x + cy * y;
      const up = cp * z + sp * into, depth = cp * into - sp * z;
      const shrink = away / Math.max(away + depth, 0.05 * away);
      return [width / 2 + right * scale * shrink, height / 2 - up * scale * shrink, depth, scale * shrink];
    };
  }
}

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
