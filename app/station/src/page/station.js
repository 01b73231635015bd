"use strict";

// The page of a station: live values over a WebSocket, a stop, and lists. Everything that comes is put in as text.

const byId = (id) => document.getElementById(id);
const LOST_AFTER_MS = 3000;
const LISTS_EVERY_MS = 15000;

// A token in the address is kept for this tab alone and taken out of the address.
const given = new URLSearchParams(location.hash.slice(1)).get("token");
if (given) {
  sessionStorage.setItem("token", given);
  history.replaceState(null, "", location.pathname);
}
const token = () => sessionStorage.getItem("token") || "";

let socket = null;
let heardAt = 0;
let pictures = { curve: { t_s: [], depth_mm: [], force_n: [] }, events: [] };
let isOverDepth = false;
// Name of the session of the run in progress, or a name that no session has.
let inProgress = "/";

async function ask(path, options = {}) {
  const headers = token() ? { Authorization: "Bearer " + token() } : {};
  const answer = await fetch(path, { ...options, headers });
  const object = await answer.json().catch(() => ({}));
  if (!answer.ok) {
    const error = new Error(object.error || "the station answers " + answer.status);
    error.status = answer.status;
    throw error;
  }
  return object;
}

function put(id, text) {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
}

function number(value, digits, unit) {
  return value === null || value === undefined ? "–" : value.toFixed(digits) + " " + unit;
}

function clock(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (part) => String(part).padStart(2, "0");
  return (hours ? hours + ":" + two(minutes) : minutes) + ":" + two(rest);
}

function fill(id, lines) {
  byId(id).replaceChildren(...lines.map(([text, kind]) => {
    const line = document.createElement("li");
    line.textContent = text;
    if (kind) line.className = kind;
    return line;
  }));
}

function show(message) {
  heardAt = Date.now();
  byId("sign-in").hidden = true;
  if (message.curve) {
    pictures = message;
    draw();
    fill("events", [...message.events].reverse().map((line) =>
      [clock(line.at_s) + "  " + line.text, line.is_alarm ? "alarm" : ""]));
  }
  const { rig, run } = message;
  inProgress = run && !run.outcome ? run.session : "/";
  put("rig", rig.name);
  document.title = (run && !run.outcome ? Math.round(run.fraction * 100) + " % · " : "") + rig.name + " · palpate";
  const isBad = (outcome) => outcome && !["finish", "stop"].includes(outcome.ending);
  const ended = run && (run.outcome || run.stopped);
  const alarm = !message.is_alive ? "The thread that controls the rig has ended. Look at the rig."
    : rig.link_error ? "The link to the rig is lost: " + rig.link_error
    : run && run.log_error ? "The session cannot be written: " + run.log_error
    : isBad(ended) ? ended.ending + ": " + ended.reason : "";
  byId("alarm").hidden = !alarm;
  put("alarm", alarm);
  put("position", number(run && !run.outcome ? run.position_mm : rig.position_mm, 2, "mm"));
  byId("sensors").hidden = rig.sensors.length === 0;
  byId("sensors").replaceChildren(...rig.sensors.map((one) => {
    const pair = document.createElement("div");
    for (const [kind, text] of [["dt", one.name], ["dd", one.words]]) {
      pair.appendChild(document.createElement(kind)).textContent = text;
    }
    return pair;
  }));
  put("armed", armedText(message.armed));
  if (!run) return;
  put("protocol", run.protocol);
  const step = "step " + Math.min(run.step.index + 1, run.step.count) + " of " + run.step.count;
  const cycle = run.cycles > 1 ? ", cycle " + run.cycle + " of " + run.cycles : "";
  put("phase", run.outcome ? run.outcome.ending + ": " + run.outcome.reason
    : run.prompt ? "waits for the operator: " + run.prompt[0]
    : (run.is_paused ? "paused, " : "") + run.phase + ", " + step + cycle);
  byId("progress").value = run.fraction;
  put("elapsed", clock(run.elapsed_s));
  put("left", run.outcome ? run.session : clock(run.time_left_s) + " left");
  put("force", number(run.force_n, 3, "N"));
  put("depth", number(run.depth_mm, 2, "mm"));
  put("peak", number(run.force_peak_n, 3, "N"));
  byId("fit").hidden = run.estimate.length === 0;
  byId("parameters").replaceChildren(...run.estimate.map((one) => {
    const row = document.createElement("tr");
    const error = one.std_error === null ? "" : " ± " + one.std_error.toPrecision(2);
    for (const text of [one.name, one.value.toPrecision(4) + error + " " + one.unit]) {
      row.insertCell().textContent = text;
    }
    return row;
  }));
}

function armedText(armed) {
  if (!armed) return "No queue is armed: nothing can be started from here.";
  return "Armed at the rig: " + armed.queue + ", until " + new Date(armed.until).toLocaleTimeString()
    + ", " + armed.runs_left + " runs left";
}

// The curve as it was measured, thinned by the station to lowest and highest values.
function draw() {
  const { t_s: times, depth_mm: depths, force_n: forces } = pictures.curve;
  const canvas = byId("curve");
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const brush = canvas.getContext("2d");
  brush.scale(ratio, ratio);
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name);
  const points = [];
  for (let i = 0; i < forces.length; i += 1) {
    const x = isOverDepth ? depths[i] : times[i];
    if (x !== null && forces[i] !== null) points.push([x, forces[i]]);
  }
  if (points.length < 2) {
    canvas.setAttribute("aria-label", "No curve yet");
    return;
  }
  const ends = (index) => {
    const values = points.map((point) => point[index]);
    const low = Math.min(...values), high = Math.max(...values);
    return low === high ? [low - 1, high + 1] : [low, high];
  };
  const [[left, right], [bottom, top]] = [ends(0), ends(1)];
  const margin = { left: 48, right: 12, top: 10, bottom: 34 };
  const toX = (x) => margin.left + (x - left) / (right - left) * (width - margin.left - margin.right);
  const toY = (y) => height - margin.bottom - (y - bottom) / (top - bottom) * (height - margin.top - margin.bottom);
  brush.font = "12px system-ui, sans-serif";
  brush.strokeStyle = colour("--line");
  brush.fillStyle = colour("--faint");
  brush.lineWidth = 1;
  brush.textAlign = "right";
  brush.textBaseline = "middle";
  for (const y of ticks(bottom, top, 5)) {
    brush.beginPath(); brush.moveTo(margin.left, toY(y)); brush.lineTo(width - margin.right, toY(y)); brush.stroke();
    brush.fillText(String(y), margin.left - 6, toY(y));
  }
  brush.textAlign = "center";
  brush.textBaseline = "top";
  for (const x of ticks(left, right, Math.max(3, Math.floor(width / 90)))) {
    brush.fillText(String(x), toX(x), height - margin.bottom + 4);
  }
  brush.fillText(isOverDepth ? "depth in mm" : "time in s", (margin.left + width) / 2, height - 15);
  brush.textAlign = "left";
  brush.fillText("N", 4, margin.top - 6);
  brush.strokeStyle = colour("--force");
  brush.lineWidth = 1.8;
  brush.lineJoin = "round";
  brush.beginPath();
  points.forEach(([x, y], i) => i ? brush.lineTo(toX(x), toY(y)) : brush.moveTo(toX(x), toY(y)));
  brush.stroke();
  canvas.setAttribute("aria-label", "Force from " + bottom + " to " + top + " N over "
    + (isOverDepth ? "depth to " + right + " mm" : "time to " + right + " s"));
}

function ticks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  const found = [];
  for (let i = Math.ceil(low / step); i * step <= high; i += 1) found.push(Number((i * step).toFixed(digits)));
  return found;
}

function link(text, isLost) {
  put("link", text);
  byId("link").classList.toggle("lost", isLost);
}

function open() {
  const scheme = location.protocol === "https:" ? "wss://" : "ws://";
  const protocols = ["palpate.v1"].concat(token() ? ["palpate-token." + token()] : []);
  socket = new WebSocket(scheme + location.host + "/api/v1/live?per_second=5", protocols);
  socket.onmessage = (event) => { link("live", false); show(JSON.parse(event.data)); };
  socket.onclose = () => { socket = null; setTimeout(connect, 1500); };
}

// A browser does not say why a WebSocket was refused, so the state is asked for first.
async function connect() {
  if (socket || document.hidden) return;
  try {
    await ask("/api/v1/state");
    open();
    lists();
  } catch (error) {
    if (error.status === 401) {
      byId("sign-in").hidden = false;
      put("sign-in-problem", token() ? error.message : "");
      link("a token is needed", true);
      return;
    }
    setTimeout(connect, 3000);
  }
}

async function lists() {
  try {
    const [queue, sessions, remote] = await Promise.all(
      ["/api/v1/queue", "/api/v1/sessions?limit=10", "/api/v1/remote"].map((path) => ask(path)));
    fill("queue", queue.specimens.length
      ? queue.specimens.map((one) => [one.specimen + "  " + one.protocol + ", " + one.state])
      : [["No specimen is queued.", "faint"]]);
    fill("asked", remote.runs.slice(-5).map((run) => [
      "run " + run.id + "  " + Object.values(run.values).join(", ") + "  " + run.state
        + (run.reason && run.state !== "ended" ? ": " + run.reason : "")]));
    fill("sessions", sessions.sessions.length
      ? sessions.sessions.map((one) => {
          const isNow = one.folder.endsWith(inProgress);
          return [new Date(one.started_at).toLocaleString() + "  " + (one.specimen || one.protocol)
            + "  " + (one.ending || (isNow ? "in progress" : "no end")),
            isNow || ["finish", "stop"].includes(one.ending) ? "" : "alarm"];
        })
      : [["No session is recorded.", "faint"]]);
  } catch (error) {
    fill("sessions", [[error.message, "faint"]]);
  }
}

async function stop() {
  const button = byId("stop");
  const say = (text, isAlarm) => {
    put("stop-answer", text);
    byId("stop-answer").classList.toggle("alarm", isAlarm);
  };
  button.disabled = true;
  try {
    const answer = await ask("/api/v1/stop", { method: "POST" });
    say("Stop passed on at " + new Date().toLocaleTimeString() + ". Watch the position: " + answer.remark + ".", false);
  } catch (error) {
    say("The stop did NOT reach the rig: " + error.message + ". Use the emergency stop.", true);
  }
  button.disabled = false;
}

byId("stop").onclick = stop;
byId("axis").onclick = (event) => {
  isOverDepth = !isOverDepth;
  event.target.textContent = isOverDepth ? "over time" : "over depth";
  put("curve-title", isOverDepth ? "Force over depth" : "Force over time");
  draw();
};
byId("sign-in").onsubmit = (event) => {
  event.preventDefault();
  sessionStorage.setItem("token", byId("token").value.trim());
  byId("token").value = "";
  connect();
};
document.onvisibilitychange = () => {
  if (document.hidden && socket) socket.close();
  else connect();
};
window.onresize = draw;
setInterval(() => {
  const age = Date.now() - heardAt;
  if (heardAt && age > LOST_AFTER_MS) {
    link("no connection for " + clock(age / 1000) + ": what you see is old, and a stop may not reach the rig", true);
  }
}, 500);
setInterval(() => { if (socket) lists(); }, LISTS_EVERY_MS);
connect();
