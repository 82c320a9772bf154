// The line to the program: opens, reopens, says how it is, and acknowledges what it has taken, so that nothing ever queues.

const TAKE = 3; // messages told of at once: half of what may be on the way, and a third of the server's work
const LATE_MS = 1000; // 30 messages are missing
const ENDED = 1012; // said by a server that ends (RFC 6455 registry: service restart); a broken line says nothing
const AGAIN_MS = [250, 500, 1000, 2000];

export class Link {
  // heard(message) for every one; told(state, words) when it changes: "live", "late", "gone".
  constructor(heard, told) {
    this.heard = heard;
    this.told = told;
    this.newest_ms = -Infinity;
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
      this.newest_ms = performance.now();
      this.tries = 0;
      this.refused = "";
      this.ended = false;
      this.heard(JSON.parse(event.data));
    };
    socket.onclose = (event) => { this.ended ||= event.code === ENDED; this.closed(); };
  }

  closed() {
    this.socket = null;
    this.newest_ms = Math.min(this.newest_ms, performance.now() - LATE_MS);
    this.look();
    this.why();
    this.again = setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries, AGAIN_MS.length - 1)]);
    this.tries += 1;
  }

  // A websocket is not told why it was refused; a request is.
  async why() {
    try {
      const answer = await fetch("/", { method: "HEAD", cache: "no-store" });
      this.refused = answer.status === 401 ? "calibeam was started anew with another token: open the address that it prints now" : "";
    } catch { this.refused = ""; }
    this.look();
  }

  look() {
    const age_ms = performance.now() - this.newest_ms;
    const seconds = Number.isFinite(age_ms) ? ` for ${Math.round(age_ms / 1000)} s` : "";
    if (this.socket && age_ms < LATE_MS) this.told("live", "");
    else if (this.socket?.readyState === WebSocket.OPEN && Number.isFinite(age_ms)) this.told("late", `Nothing heard${seconds}: the connection is slow or calibeam is held up. What you see is old.`);
    else this.told("gone", this.refused || `${this.ended ? "calibeam has ended its page" : "Not connected to calibeam"}; nothing heard${seconds}, trying again. What you see is old. STOP may not arrive.`);
  }
}
