"use strict";
// Shows what the server sends: see tomr_view/picture.py for what a picture holds.

const SPAN = 30; // s of the charts
const LEVELS = ["--ok", "--warn", "--error", "--stale"];
const $ = (id) => document.getElementById(id);

let hello = null;
let pictures = []; // sparse for a recording: pictures[i] is asked for when it is needed
let now = 0; // index of the picture that is shown
let socket = null;
let asked = new Set();
let playing = false;
let isDirty = true;

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(`${scheme}//${location.host}/socket`);
  socket.onmessage = (event) => receive(JSON.parse(event.data));
  socket.onopen = () => { $("link").textContent = ""; };
  socket.onclose = () => {
    $("link").textContent = "connection lost, trying again";
    setTimeout(connect, 1000);
  };
}

function receive(message) {
  const take = {
    hello: begin,
    update: (news) => { Object.assign(hello, news); showFaults(); },
    pictures: (news) => {
      news.pictures.forEach((picture, i) => { pictures[news.first + i] = picture; });
      asked.delete(news.first);
      if (hello.mode === "live") now = Math.max(0, pictures.length - 1);
    },
    picture: (news) => {
      const last = pictures[pictures.length - 1];
      if (last && news.picture.t < last.t) pictures = []; // the robot's time began afresh
      pictures.push(news.picture);
      if (pictures.length > 2000) pictures.splice(0, 1000);
      now = pictures.length - 1;
    },
  }[message.kind];
  if (take) take(message);
  isDirty = true;
}

function begin(news) {
  hello = news;
  pictures = [];
  asked.clear();
  now = 0;
  $("title").textContent = hello.title;
  document.title = `TOMR ${hello.title}`;
  const isRecording = hello.mode === "recording";
  $("player").hidden = !isRecording;
  if (isRecording) {
    $("scrub").max = hello.count - 1;
    const wanted = Number(/t=([\d.]+)/.exec(location.hash)?.[1] || 0); // a link to a moment
    seek(Math.max(0, hello.times.findLastIndex((t) => t <= wanted)));
  }
  showFaults();
}

// --- recordings -----------------------------------------------------------------------------

const CHUNK = 300;

function want(first, last) {
  for (let chunk = Math.max(0, Math.floor(first / CHUNK)); chunk * CHUNK <= last; chunk++) {
    const start = chunk * CHUNK;
    if (start >= hello.count || pictures[start] || asked.has(start)) continue;
    if (socket.readyState !== WebSocket.OPEN) return;
    asked.add(start);
    socket.send(JSON.stringify({ ask: "pictures", first: start, count: CHUNK }));
  }
}

function seek(index) {
  now = Math.min(Math.max(0, index), hello.count - 1);
  $("scrub").value = now;
  isDirty = true;
}

$("scrub").oninput = () => seek(Number($("scrub").value));
$("play").onclick = () => {
  playing = !playing;
  $("play").textContent = playing ? "pause" : "play";
  if (playing && now >= hello.count - 1) seek(0);
};
setInterval(() => {
  if (!playing || !hello) return;
  if (now >= hello.count - 1) $("play").onclick(); else seek(now + 1);
}, 100);

// --- faults ---------------------------------------------------------------------------------

function showFaults() {
  const faults = hello.faults || [];
  $("faults").hidden = faults.length === 0;
  const choices = faults.map((fault) => new Option(fault.id.replaceAll("_", " "), fault.id));
  $("fault").replaceChildren(...choices);
  chooseFault();
}

function chooseFault() {
  const fault = (hello.faults || []).find((item) => item.id === $("fault").value);
  $("wheel").hidden = !fault || !fault.has_wheel;
}

function wish(what) {
  socket.send(JSON.stringify({ ask: "fault", ...what }));
}

$("fault").onchange = chooseFault;
$("bring").onclick = () => {
  const wheel = $("wheel").hidden ? {} : { wheel: Number($("wheel").value) };
  wish({ id: $("fault").value, severity: 1, ...wheel });
};
$("take").onclick = () => wish({ id: null });

// --- drawing --------------------------------------------------------------------------------

function sheet(id) {
  const canvas = $(id);
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

function recent() {
  const current = pictures[now];
  const found = [];
  for (let i = now; i >= 0 && pictures[i] && current.t - pictures[i].t <= SPAN; i--) found.push(pictures[i]);
  return found.reverse();
}

function chart(pen, box, shown, label, lines, band) {
  // One strip over time. lines: [{name of colour, value(picture)}]; band(picture): half width.
  const end = shown[shown.length - 1].t;
  const x = (t) => box.x + box.width * (1 - (end - t) / SPAN);
  let low = Infinity, high = -Infinity;
  for (const picture of shown) {
    for (const line of lines) {
      const value = line.value(picture);
      if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
    }
    const half = band && band(picture);
    if (half) { low = Math.min(low, -half); high = Math.max(high, half); }
  }
  if (!(low <= high)) { low = -1; high = 1; }
  const room = Math.max(0.08 * (high - low), 1e-6);
  low -= room; high += room;
  const y = (value) => box.y + box.height * (high - value) / (high - low);
  if (band) {
    pen.fillStyle = colour("--band");
    pen.beginPath();
    let isOpen = false;
    const upper = [], lower = [];
    for (const picture of shown) {
      const half = band(picture);
      if (half === null) continue;
      upper.push([x(picture.t), y(half)]);
      lower.push([x(picture.t), y(-half)]);
    }
    for (const [a, b] of upper.concat(lower.reverse())) {
      if (isOpen) pen.lineTo(a, b); else pen.moveTo(a, b);
      isOpen = true;
    }
    pen.fill();
  }
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  pen.strokeRect(box.x, box.y, box.width, box.height);
  if (low < 0 && high > 0) {
    pen.beginPath(); pen.moveTo(box.x, y(0)); pen.lineTo(box.x + box.width, y(0)); pen.stroke();
  }
  for (const line of lines) {
    pen.strokeStyle = colour(line.colour);
    pen.lineWidth = 1.5;
    pen.beginPath();
    let isDown = false;
    for (const picture of shown) {
      const value = line.value(picture);
      if (value === null) { isDown = false; continue; }
      if (isDown) pen.lineTo(x(picture.t), y(value)); else pen.moveTo(x(picture.t), y(value));
      isDown = true;
    }
    pen.stroke();
  }
  pen.fillStyle = colour("--soft");
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  pen.fillText(label, 0, box.y + box.height / 2);
  const last = lines[0].value(shown[shown.length - 1]);
  pen.textAlign = "right";
  pen.fillStyle = colour("--ink");
  pen.fillText(last === null ? "–" : last.toPrecision(3), box.x + box.width + 58, box.y + box.height / 2);
}

function strips(id, count, draw) {
  const { pen, width, height } = sheet(id);
  const left = id === "power" ? 100 : 205;
  for (let i = 0; i < count; i++) {
    const step = height / count;
    draw(pen, { x: left, y: i * step + 2, width: width - left - 62, height: step - 5 }, i);
  }
}

function drawPower(shown) {
  const names = [...hello.robot.wheels, "whole robot"];
  strips("power", 4, (pen, box, i) => {
    const unit = pictures[now].units[i];
    chart(pen, box, shown, `${names[i].replace("_", " ")}, ${unit}`, [
      { colour: "--measured", value: (p) => p.powers[i][0] },
      { colour: "--modelled", value: (p) => p.powers[i][1] },
    ]);
  });
}

function drawResiduals(shown) {
  strips("residuals", 10, (pen, box, i) => {
    const [value, band] = pictures[now].residuals[i];
    const isBeyond = value !== null && Math.abs(value) > band;
    chart(pen, box, shown, hello.robot.residuals[i].replace("_", " "),
      [{ colour: isBeyond ? "--beyond" : "--measured", value: (p) => p.residuals[i][0] }],
      (p) => p.residuals[i][1]);
  });
}

function drawStates(shown) {
  const { pen, width, height } = sheet("states");
  const left = 64, room = width - left;
  const end = shown[shown.length - 1].t;
  const x = (t) => left + room * (1 - (end - t) / SPAN);
  const rows = [["named", (p) => colour(LEVELS[p.level] || "--stale")]];
  if (shown.some((p) => p.faults)) {
    rows.unshift(["truth", (p) => p.faults === null ? null : colour(p.faults.length ? "--error" : "--ok")]);
  }
  const step = (height - 16) / rows.length;
  rows.forEach(([label, paint], row) => {
    pen.fillStyle = colour("--soft");
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    pen.fillText(label, 0, row * step + step / 2);
    shown.forEach((picture, i) => {
      const fill = paint(picture);
      if (fill === null) return;
      const next = i + 1 < shown.length ? shown[i + 1].t : picture.t + 0.1;
      pen.fillStyle = fill;
      pen.fillRect(x(picture.t), row * step + 3, Math.max(1, x(next) - x(picture.t) + 0.5), step - 6);
    });
  });
  pen.fillStyle = colour("--soft");
  pen.textAlign = "right";
  pen.fillText(`${end.toFixed(1)} s`, width, height - 7);
  pen.textAlign = "left";
  pen.fillText(`${SPAN} s before`, left, height - 7);
}

function drawRobot(shown) {
  const { pen, width, height } = sheet("robot");
  const picture = pictures[now], robot = hello.robot;
  const scale = 0.22 * Math.min(width, height) / robot.radius;
  const [px, py, yaw] = picture.pose;
  pen.save();
  pen.translate(width / 2, height / 2);
  pen.scale(scale, -scale);
  // The floor moves, the robot stays in the middle; x of the world is to the right.
  pen.lineWidth = 1 / scale;
  pen.strokeStyle = colour("--line");
  const grid = robot.radius, far = Math.max(width, height) / scale / 2;
  for (let k = -Math.ceil(far / grid) - 1; k <= Math.ceil(far / grid) + 1; k++) {
    const gx = k * grid - (px % grid), gy = k * grid - (py % grid);
    pen.beginPath();
    pen.moveTo(gx, -far); pen.lineTo(gx, far);
    pen.moveTo(-far, gy); pen.lineTo(far, gy);
    pen.stroke();
  }
  pen.strokeStyle = colour("--soft");
  pen.lineWidth = 1.5 / scale;
  pen.beginPath();
  shown.forEach((p, i) => {
    const a = p.pose[0] - px, b = p.pose[1] - py;
    if (i) pen.lineTo(a, b); else pen.moveTo(a, b);
  });
  pen.stroke();
  pen.rotate(yaw);
  pen.fillStyle = colour("--panel");
  pen.strokeStyle = colour("--ink");
  pen.lineWidth = 2 / scale;
  pen.beginPath(); pen.arc(0, 0, robot.radius * 0.9, 0, 2 * Math.PI); pen.fill(); pen.stroke();
  pen.beginPath(); // forwards
  pen.moveTo(robot.radius * 0.55, 0);
  pen.lineTo(robot.radius * 0.25, robot.radius * 0.14);
  pen.lineTo(robot.radius * 0.25, -robot.radius * 0.14);
  pen.closePath(); pen.fillStyle = colour("--ink"); pen.fill();
  robot.angles.forEach((angle, i) => drawWheel(pen, scale, picture, angle, i));
  pen.restore();
}

function drawWheel(pen, scale, picture, angle, i) {
  const robot = hello.robot, size = Math.max(robot.wheel_radius, 0.2 * robot.radius);
  pen.save();
  pen.rotate(angle);
  pen.translate(robot.radius, 0);
  const isFaulty = picture.state.endsWith(` ${i + 1}`) || picture.message.includes(robot.wheels[i]);
  pen.fillStyle = colour(isFaulty ? "--error" : "--soft");
  pen.fillRect(-0.3 * size, -size, 0.6 * size, 2 * size);
  // A wheel that turns forwards drives towards -y of its own frame.
  const arrow = (value, name, aside) => {
    if (value === null) return;
    const length = -0.08 * value * robot.wheel_radius / 0.05 * robot.radius;
    pen.strokeStyle = colour(name);
    pen.lineWidth = 3 / scale;
    pen.beginPath(); pen.moveTo(aside, 0); pen.lineTo(aside, length); pen.stroke();
    pen.beginPath(); pen.arc(aside, length, 4 / scale, 0, 2 * Math.PI);
    pen.fillStyle = colour(name); pen.fill();
  };
  arrow(picture.expected[i], "--modelled", 0.62 * size);
  arrow(picture.speeds[i], "--measured", 0.95 * size);
  pen.save();
  pen.translate(1.6 * size, 0);
  pen.rotate(-angle - picture.pose[2]);
  pen.scale(1 / scale, -1 / scale);
  pen.fillStyle = colour("--soft");
  pen.textAlign = "center"; pen.textBaseline = "middle";
  pen.fillText(String(i + 1), 0, 0);
  pen.restore();
  pen.restore();
}

function showWords(picture) {
  $("state").textContent = picture.message;
  $("state").dataset.level = picture.level;
  const shares = [];
  for (const [name, share] of Object.entries(picture.shares || {})) {
    const label = document.createElement("span"), bar = document.createElement("b");
    const text = document.createElement("span");
    label.textContent = name;
    bar.style.width = `${100 * share}%`;
    text.textContent = `${(100 * share).toFixed(share > 0.995 || share < 0.005 ? 0 : 1)} %`;
    shares.push(label, bar, text);
  }
  $("shares").replaceChildren(...shares);
  $("severity").textContent = picture.severity || "";
  $("conditions").textContent = picture.conditions ? `changed: ${picture.conditions}` : "";
  $("unseen").textContent = picture.unseen ? `not observable in this motion: ${picture.unseen}` : "";
  const lines = (picture.evidence || []).map((line) => {
    const item = document.createElement("li");
    item.textContent = line;
    return item;
  });
  $("evidence").replaceChildren(...lines);
  const rows = picture.inputs.map((input) => {
    const row = document.createElement("tr");
    row.dataset.level = input.level;
    const rate = input.rate ? `${input.rate} Hz` : "";
    for (const text of [input.topic, input.message, rate]) {
      row.insertCell().textContent = text;
    }
    return row;
  });
  $("inputs").replaceChildren(...rows);
  $("inputs_title").hidden = rows.length === 0;
  const on = (picture.faults || []).map((fault) => `${fault.id} ${fault.wheel || ""}`.trim());
  $("on").textContent = on.length ? `in force: ${on.join(", ").replaceAll("_", " ")}` : "";
}

function drawSpells() {
  const { pen, width, height } = sheet("spells");
  for (const [first, last, , level] of hello.spells) {
    pen.fillStyle = colour(LEVELS[level] || "--stale");
    pen.fillRect(width * first / hello.count, 0, Math.max(1, width * (last + 1 - first) / hello.count), height);
  }
}

function draw() {
  requestAnimationFrame(draw);
  if (!isDirty || !hello) return;
  isDirty = false;
  if (hello.mode === "recording") {
    want(now - 10 * SPAN, now + CHUNK);
    $("moment").textContent = `${hello.times[now].toFixed(1)} of ${hello.times[hello.count - 1].toFixed(1)} s`;
    drawSpells();
  }
  const picture = pictures[now];
  if (!picture) {
    if (hello.mode === "live") $("state").textContent = "waiting for the diagnosis";
    return;
  }
  const shown = recent();
  showWords(picture);
  drawRobot(shown);
  drawPower(shown);
  drawResiduals(shown);
  drawStates(shown);
  document.body.dataset.t = picture.t; // for those who watch the page
}

window.onresize = () => { isDirty = true; };
matchMedia("(prefers-color-scheme: dark)").onchange = () => { isDirty = true; };
connect();
requestAnimationFrame(draw);
