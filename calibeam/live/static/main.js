// The page: hears messages, keeps the newest of each kind, draws once a frame at most.

import { FaceView } from "./face.js";
import { JointsView } from "./joints.js";
import { Link } from "./link.js";
import { RobotView } from "./robot.js";
import { StopButton } from "./stop.js";
import { put, sayDevices, sayLink, sayLog, sayProgress, sayRig } from "./words.js";

const get = (id) => document.getElementById(id);
const newest = { rig: null, state: null, now: null };
let link = "gone";
let waiting = false;

const faces = [new FaceView(get("face-1")), new FaceView(get("face-2"))];
const robot = new RobotView(get("robot"), document.querySelectorAll("[data-view]"), draw);
const joints = new JointsView(get("joints"));
const stop = new StopButton(get("stop"), get("stop-says"));

new Link(heard, (state, words) => {
  sayLink(state, words);
  if (state !== link) {
    link = state;
    if (newest.state) sayDevices(newest.state.devices, link === "live");
    if (link !== "live") stop.forget();
    draw();
  }
});
document.addEventListener("resized", draw);

function heard(message) {
  newest[message.kind] = message;
  const at_ms = performance.now();
  if (message.kind === "rig") { sayRig(message); robot.fit(message.reach_m); }
  if (message.kind === "state") told(message);
  if (message.kind === "now") {
    faces.forEach((face, k) => face.hear(message.faces?.[k] ?? null, at_ms));
    joints.hear(message.q_rad, at_ms, newest.rig?.lower_rad.length ?? 6);
    draw();
  }
}

function told(state) {
  sayProgress(state.progress, newest.rig?.job);
  sayDevices(state.devices, true);
  sayLog(state.lines);
  stop.hear(state.stop);
  put(get("beam-says"), newest.rig?.half_m == null ? "" : `${place(state.standing)} On the faces ● is measured, ◇ expected by the model.`);
  put(get("joints-by"), newest.now?.by ? `last ${Math.round(joints.span_ms(performance.now()) / 1000)} s, read by the ${newest.now.by}` : "");
}

function place(standing) {
  if (!standing) return "No station of the fixture is near the beam.";
  const beam = newest.now?.beam?.says ?? "";
  return `Fixture at station ${standing.placement}${standing.told ? "" : " (guessed)"}, PSD ${standing.first_psd} first${beam ? `: ${beam}` : ""}.`;
}

// Whether the model puts no light on a face: the beam leads elsewhere, misses it, or misses the face before it. Where
// nothing is known of the beam, light is expected.
function isDark(k, now, state, rig) {
  if (!now?.beam) return false;
  const spots = now.beam.spots_m, half = now.faces?.[k]?.half_m ?? rig?.half_m;
  if (!spots) return true;
  const onFace = Math.max(Math.abs(spots[2 * k]), Math.abs(spots[2 * k + 1])) <= half;
  return !onFace || !(now.beam.both || state?.standing?.first_psd === k + 1);
}

function draw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    const { now, state, rig } = newest, live = link === "live", at_ms = performance.now();
    const spots = now?.beam?.spots_m;
    faces.forEach((face, k) => face.draw(now?.faces?.[k] ?? null, spots?.slice(2 * k, 2 * k + 2), rig?.half_m, at_ms, live, isDark(k, now, state, rig)));
    robot.draw(now, state?.standing ?? null, live);
    joints.draw(now?.q_rad, at_ms, live);
  });
}
