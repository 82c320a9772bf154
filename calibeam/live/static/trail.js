// The last seconds of a few numbers, in memory of a fixed size: a page that is open for days does not grow.

export class Trail {
  constructor(length, width) {
    this.length = length;
    this.width = width;
    this.at_ms = new Float64Array(length);
    this.values = new Float64Array(length * width);
    this.count = 0;
  }

  // NaN for what is not known: a gap is drawn as a gap.
  push(at_ms, values) {
    const row = this.count % this.length;
    this.at_ms[row] = at_ms;
    for (let k = 0; k < this.width; k += 1) this.values[row * this.width + k] = values[k] ?? NaN;
    this.count += 1;
  }

  // Oldest first: visit(at_ms, row) with row * width the first of its values.
  each(since_ms, visit) {
    const kept = Math.min(this.count, this.length);
    for (let k = this.count - kept; k < this.count; k += 1) {
      const row = k % this.length;
      if (this.at_ms[row] >= since_ms) visit(this.at_ms[row], row);
    }
  }

  clear() { this.count = 0; }
}
