// STOP: a request of its own, so that it goes out whatever the state of the other line; and what became of it, in words.

import { put } from "./words.js";

const PATIENCE_MS = 6000; // the slowest way to a controller takes 2 s to be known closed

export class StopButton {
  constructor(button, says) {
    this.button = button;
    this.says = says;
    this.pressed_ms = -Infinity;
    this.failed = false; // the last press here, as far as this page knows
    button.addEventListener("pointerdown", () => this.press()); // sooner than a click, and a slipping glove is none
    button.addEventListener("click", (event) => { if (event.detail === 0) this.press(); }); // a key
  }

  async press() {
    const pressed_ms = this.pressed_ms = performance.now();
    this.failed = false;
    this.button.classList.add("sent");
    this.tell("", "STOP sent …");
    const [is, words] = await this.ask();
    this.button.classList.remove("sent");
    if (pressed_ms !== this.pressed_ms) return; // a newer press tells
    this.failed = is === "failed";
    this.tell(is, words);
  }

  async ask() {
    try {
      const answer = await fetch("/stop", { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) });
      if (!answer.ok) throw new Error(`refused (${answer.status})`);
      const told = await answer.json();
      return told.delivered ? ["done", `✓ ${told.says}`] : ["failed", `✕ ${told.says}`];
    } catch (error) {
      return ["failed", `✕ STOP NOT DELIVERED (${error.name === "TimeoutError" ? "no answer" : error.message}): press the red emergency stop now`];
    }
  }

  // What every page hears of a STOP, whoever pressed it. A press that failed here stays told until a STOP came after it.
  hear(stop) {
    const since_ms = performance.now() - this.pressed_ms;
    if (since_ms < PATIENCE_MS || (this.failed && !(stop.delivered !== null && 1e3 * stop.age_s < since_ms))) return;
    if (stop.delivered === null) this.tell("", stop.ready ? "" : "STOP has no arm to stop: none is connected.");
    else this.tell(stop.delivered ? "done" : "failed", `${stop.delivered ? "✓ " : "✕ "}STOP ${ago(stop.age_s)}, by ${stop.who}: ${stop.says}`);
  }

  // Without a connection nobody knows whether there is an arm; that a STOP failed stays told.
  forget() {
    if (performance.now() - this.pressed_ms > PATIENCE_MS && this.says.dataset.is !== "failed") this.tell("", "");
  }

  tell(is, words) {
    if (this.says.dataset.is !== is) this.says.dataset.is = is;
    put(this.says, words);
  }
}

const ago = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`);
