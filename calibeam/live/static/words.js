// Everything on the page that is words: link, progress, devices, log. Text is set only when it changes.

const MARKS = { live: "✓", stale: "!", lost: "✕", waiting: "…" };
const NAMES = { psd: "Detectors", robot: "Robot", encoders: "Encoders" };

const get = (id) => document.getElementById(id);
export const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

export function sayLink(state, words) {
  document.body.dataset.link = state;
  put(get("link-says"), { live: "✓ live", late: "! late", gone: "✕ not connected" }[state]);
  const banner = get("banner");
  banner.hidden = words === "";
  put(banner, words);
}

export function sayRig(rig) {
  put(get("rig-name"), rig.name);
  document.title = `${rig.name} – calibeam live`;
  put(get("stop-does"), rig.job === "watch" ? "STOP ends the program that the controller runs." : "STOP ends the session; what was recorded is kept.");
  document.querySelector(".panel.robot").hidden = rig.reach_m === 0; // a rig of encoders alone has no arm
  put(get("robot-head"), rig.half_m === null ? "Arm" : "Robot and beam");
  document.querySelector("[data-view=beam]").hidden = rig.half_m === null;
  for (const id of ["face-1", "face-2"]) get(id).hidden = !rig.devices.includes("psd");
}

export function sayProgress(progress, job) {
  const bar = get("bar");
  put(get("phase"), progress?.phase ?? (job === "watch" ? "watching" : "starting"));
  const counted = progress && progress.total !== null;
  put(get("count"), counted ? `pose ${progress.done} of ${progress.total}` : progress?.done ? `pose ${progress.done}` : "");
  put(get("left"), progress?.left_s == null ? "" : `${duration(progress.left_s)} left`);
  put(get("note"), progress?.note ?? "");
  bar.hidden = !counted;
  if (counted) bar.value = progress.total ? progress.done / progress.total : 0;
}

export function sayDevices(devices, live) {
  const list = get("devices");
  while (list.children.length > devices.length) list.lastChild.remove();
  while (list.children.length < devices.length) list.append(row());
  devices.forEach((device, k) => fill(list.children[k], device, live));
}

function row() {
  const item = document.createElement("li");
  for (const [tag, name] of [["span", "mark"], ["b", "name"], ["span", "figures"], ["span", "says"]]) {
    const cell = document.createElement(tag);
    cell.className = name;
    item.append(cell);
  }
  return item;
}

function fill(item, device, live) {
  const [mark, name, figures, says] = item.children;
  const is = live ? device.state : "stale";
  item.dataset.is = is;
  put(mark, live ? MARKS[device.state] : "?");
  put(name, NAMES[device.device] ?? device.device);
  const rate = device.rate_hz === null ? "" : `${Math.round(device.rate_hz)} Hz`;
  const age = device.age_s === null ? "" : `${device.age_s < 1 ? `${Math.round(1e3 * device.age_s)} ms` : `${device.age_s.toFixed(1)} s`} old`;
  const lost = `${device.lost} lost`;
  const words = live ? [device.state.toUpperCase(), rate, age, device.age_s === null ? "" : lost] : ["not known: no connection to calibeam"];
  put(figures, words.filter(Boolean).join(" · "));
  put(says, live ? device.says : "");
}

export function sayLog(lines) {
  const list = get("log");
  const newest = [...lines].reverse();
  const stamp = newest.length ? `${newest[0].number} ${newest.length}` : "none";
  if (list.dataset.stamp === stamp) return;
  list.dataset.stamp = stamp;
  list.replaceChildren(...(newest.length ? newest.map(entry) : [nothing()]));
}

function entry(line) {
  const item = document.createElement("li"), time = document.createElement("time");
  time.textContent = new Date(Date.now() - 1e3 * line.age_s).toLocaleTimeString([], { hour12: false });
  item.append(time, line.text);
  return item;
}

function nothing() {
  const item = document.createElement("li");
  item.textContent = "no entries yet";
  item.className = "quiet";
  return item;
}

function duration(seconds) {
  const minutes = Math.round(seconds / 60);
  if (seconds < 90) return `${Math.round(seconds)} s`;
  return minutes < 90 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}
