// The line to the program: opens, reopens, says how it is, and acknowledges what it has taken, so that nothing ever queues.

const TAKE = 3; // messages told of at once: half of what may be on the way, and a third of the server's work
const LATE_MS = 1000; // 30 messages are missing
const ENDED = 1012; // said by a server that ends (RFC 6455 registry: service restart); a broken line says nothing
const TOO_MANY = 1013; // the same registry: try again later (limits.py)
const AGAIN_MS = [250, 500, 1000, 2000];

export class Link {
  // heard(message) for every one; told(state, words) a few times a second: "live", "late", "gone". Live is what is young
  // in both kinds that go on: one of them may fail to be made while the other comes.
  constructor(heard, told) {
    this.heard = heard;
    this.told = told;
    this.heard_ms = { any: -Infinity, now: -Infinity, state: -Infinity };
    this.trouble = { now: "", state: "" };
    this.tries = 0;
    this.refused = "";
    this.open();
    setInterval(() => this.look(), 250);
    document.addEventListener("visibilitychange", () => { if (!document.hidden && !this.socket) this.open(); });
  }

  open() {
    clearTimeout(this.again);
    const socket = new WebSocket(`ws://${location.host}/feed`);
    this.socket = socket;
    this.untaken = 0;
    socket.onmessage = (event) => {
      this.untaken += 1;
      if (this.untaken === TAKE) { socket.send(String(TAKE)); this.untaken = 0; }
      this.tries = 0;
      this.refused = "";
      this.ended = this.full = false;
      this.take(JSON.parse(event.data));
    };
    socket.onclose = (event) => { this.ended ||= event.code === ENDED; this.full ||= event.code === TOO_MANY; this.closed(); };
  }

  take(message) {
    this.heard_ms.any = performance.now();
    if (message.kind === "trouble") this.trouble[message.of] = message.says;
    else if (message.kind in this.trouble) {
      this.heard_ms[message.kind] = this.heard_ms.any;
      this.trouble[message.kind] = "";
    }
    this.heard(message);
  }

  closed() {
    this.socket = null;
    this.trouble = { now: "", state: "" };
    for (const kind in this.heard_ms) this.heard_ms[kind] = Math.min(this.heard_ms[kind], performance.now() - LATE_MS);
    this.look();
    this.why();
    this.again = setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries, AGAIN_MS.length - 1)]);
    this.tries += 1;
  }

  // A websocket is not told why it was refused; a request is.
  async why() {
    try {
      const answer = await fetch("/", { method: "HEAD", cache: "no-store" });
      this.refused = answer.status === 401 ? "calibeam was restarted with another token: open the address that it prints now" : "";
    } catch { this.refused = ""; }
    this.look();
  }

  look() {
    const at_ms = performance.now(), silent_ms = at_ms - this.heard_ms.any, old_ms = at_ms - Math.min(this.heard_ms.now, this.heard_ms.state);
    const seconds = Number.isFinite(silent_ms) ? ` for ${Math.round(silent_ms / 1000)} s` : "";
    const arrives = this.socket && silent_ms < LATE_MS, trouble = this.trouble.now || this.trouble.state;
    if (arrives && old_ms < LATE_MS) this.told("live", trouble);
    else if (arrives) this.told("late", trouble || "Only part of the data arrives. What you see is old.");
    else if (this.socket?.readyState === WebSocket.OPEN && Number.isFinite(silent_ms)) this.told("late", `Nothing heard${seconds}: the connection is slow or calibeam is held up. What you see is old.`);
    else this.told("gone", this.refused || (this.full && "Too many pages are open: close one of them. This page tries again. STOP works.") || `${this.ended ? "calibeam has ended its page" : "Not connected to calibeam"}; nothing heard${seconds}, trying again. What you see is old. STOP may not arrive.`);
  }
}
