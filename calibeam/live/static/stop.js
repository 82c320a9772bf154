// STOP: a request of its own, so that it goes out whatever the state of the other line; and what became of it, in words.

import { put } from "./words.js";

const PATIENCE_MS = 6000; // the slowest way to a controller takes 2 s to be known closed

export class StopButton {
  constructor(button, says) {
    this.button = button;
    this.says = says;
    this.pressed_ms = -Infinity;
    button.addEventListener("pointerdown", () => this.press()); // sooner than a click, and a slipping glove is none
    button.addEventListener("click", (event) => { if (event.detail === 0) this.press(); }); // a key
  }

  async press() {
    this.pressed_ms = performance.now();
    this.button.classList.add("sent");
    this.tell("", "STOP sent …");
    try {
      const answer = await fetch("/stop", { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) });
      if (!answer.ok) throw new Error(`refused (${answer.status})`);
      const told = await answer.json();
      this.tell(told.delivered ? "done" : "failed", `${told.delivered ? "✓ " : "✕ "}${told.says}`);
    } catch (error) {
      this.tell("failed", `✕ STOP NOT DELIVERED (${error.name === "TimeoutError" ? "no answer" : error.message}): press the red emergency stop now`);
    } finally {
      this.button.classList.remove("sent");
    }
  }

  // What every page hears of a STOP, whoever pressed it.
  hear(stop) {
    if (performance.now() - this.pressed_ms < PATIENCE_MS) return;
    if (stop.delivered === null) this.tell("", stop.ready ? "" : "STOP has no arm to stop: none is connected.");
    else this.tell(stop.delivered ? "done" : "failed", `${stop.delivered ? "✓ " : "✕ "}STOP ${ago(stop.age_s)}, by ${stop.who}: ${stop.says}`);
  }

  // Without a connection nobody knows whether there is an arm.
  forget() {
    if (performance.now() - this.pressed_ms > PATIENCE_MS) this.tell("", "");
  }

  tell(is, words) {
    if (this.says.dataset.is !== is) this.says.dataset.is = is;
    put(this.says, words);
  }
}

const ago = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s ago` : `${Math.round(seconds / 60)} min ago`);
