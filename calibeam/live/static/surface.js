// A canvas as sharp as its screen, in CSS pixels; sized again only when its box changes, which it tells by "resized".

export class Surface {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.width = 0;
    this.height = 0;
    this.changed = true;
    new ResizeObserver(() => {
      this.changed = true;
      canvas.dispatchEvent(new Event("resized", { bubbles: true }));
    }).observe(canvas);
  }

  // Cleared and ready; false while it has no size.
  begin() {
    if (this.changed) {
      const ratio = Math.min(window.devicePixelRatio || 1, 3);
      const box = this.canvas.getBoundingClientRect();
      this.width = box.width;
      this.height = box.height;
      this.canvas.width = Math.round(box.width * ratio);
      this.canvas.height = Math.round(box.height * ratio);
      this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      this.changed = false;
    }
    this.pen.clearRect(0, 0, this.width, this.height);
    return this.width > 0 && this.height > 0;
  }

  // Words over everything, on the page's ground: read in sunlight.
  shout(words, size = 20) {
    const { pen } = this;
    pen.save();
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    const lines = words.split("\n");
    const widest = Math.max(...lines.map((line, k) => { pen.font = font(k ? size * 0.72 : size, 800); return pen.measureText(line).width; }));
    const fit = Math.min(1, (this.width - 24) / widest);
    const step = size * fit * 1.25;
    pen.fillStyle = COLOUR.halo;
    pen.fillRect(0, this.height / 2 - step * lines.length / 2 - 8, this.width, step * lines.length + 16);
    pen.fillStyle = COLOUR.bad;
    lines.forEach((line, k) => {
      pen.font = font((k ? size * 0.72 : size) * fit, 800);
      pen.fillText(line, this.width / 2, this.height / 2 + (k - (lines.length - 1) / 2) * step);
    });
    pen.restore();
  }
}

export const font = (size, weight = 500) => `${weight} ${size}px system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif`;

// Of live.css, read again when light and dark change: a canvas cannot read them for nothing.
const NAMES = ["ink", "quiet", "line", "faint", "good", "warn", "bad", "measured", "model", "panel", "beam", "halo", "shadow"];
export const COLOUR = {};

function learn() {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) COLOUR[name] = style.getPropertyValue(`--${name}`).trim();
  document.dispatchEvent(new Event("resized"));
}

learn();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", learn);
