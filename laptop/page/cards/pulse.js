// The heartbeat of the page: detects a lost connection, and sends STOP on two channels.

const BEAT_TIMEOUT = 800; // ms without a beat, after which the page counts as cut off
const GATE_TIMEOUT = 3000; // ms without a message, after which the gate's connection is replaced
const SOCKET_TIMEOUT = 5000; // ms, the same of the page's socket; engine.io itself waits for 30 s
const MAX_RECONNECTION_DELAY = 1000; // ms; a page's process is soon replaced
const FIRST_BEAT_TIMEOUT = 10000; // ms
const REPORTED_GAP = 1500; // ms without a beat, after which this page's own standstill is reported
const CLOCK_BEATS = 40; // beats from which the clocks' offset is estimated

const pulse = { beat: performance.now() + FIRST_BEAT_TIMEOUT, gate: -Infinity, connected: -Infinity, pressed: -Infinity, lastTick: performance.now(), standstill: 0, clocks: [], stopping: false, failed: false };

// Start the heartbeat.  gatePort: TCP port of the stop gate; page: NiceGUI's id of this page.
function beginPulse(gatePort, page) {
  reportPresence(page);
  const gate = `${location.protocol}//${location.hostname}:${gatePort}`;
  watchGate(gate);
  withSocket((socket) => {
    socket.on("beat", (t) => {
      reportGap(page);
      pulse.beat = performance.now();
      pulse.clocks = [...pulse.clocks, pulse.beat - 1000 * t].slice(-CLOCK_BEATS);
      socket.volatile.emit("echo", t);
      updateStatus();
    });
    socket.on("connect", () => (pulse.connected = performance.now()));
    socket.io.reconnectionDelayMax(MAX_RECONNECTION_DELAY);
    // Drop what was pressed while the page was cut off, and report it: the user may not have noticed.
    socket.io.on("reconnect", () => {
      socket.sendBuffer = [];
      if (pulse.pressed > pulse.beat) warn("the page was cut off when this was pressed; look, then do it again");
    });
  });
  setInterval(() => {
    recordStandstill();
    updateStatus();
  }, 100);
  setInterval(closeSilentSocket, 1000);

  const pressed = (event) => event.target.closest?.(".stop");
  addEventListener("pointerdown", (event) => {
    if (!pressed(event)) pulse.pressed = performance.now();
    else if (event.button === 0) stopArm(gate);
  }, true);
  // By keys and screen readers; a pointer has stopped it already (detail > 0).
  addEventListener("click", (event) => {
    if (!pressed(event)) pulse.pressed = performance.now();
    else if (event.detail === 0) stopArm(gate);
  }, true);
  addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !event.repeat) stopArm(gate);
    else if (!isCutOff()) pulse.pressed = performance.now();
    else if (event.key !== "Tab" && !(pressed(event) && " Enter".includes(event.key)))
      event.stopImmediatePropagation();
  }, true);
}

// Report whether the page is visible, frozen or closed, which explains a silence.
function reportPresence(page) {
  let closed = false; // a page that closes is hidden, too
  const report = (word) => closed || navigator.sendBeacon(`/presence?page=${page}&word=${word}`);
  const reportNow = () => report(document.visibilityState);
  document.addEventListener("visibilitychange", reportNow);
  document.addEventListener("freeze", () => report("asleep"));
  document.addEventListener("resume", reportNow);
  addEventListener("pagehide", () => {
    report("closed");
    closed = true;
  });
  addEventListener("pageshow", () => {
    closed = false;
    reportNow();
  });
  withSocket((socket) => socket.on("connect", reportNow));
}

// Record the longest standstill of this page since the last beat, ms.
function recordStandstill() {
  const now = performance.now();
  pulse.standstill = Math.max(pulse.standstill, now - pulse.lastTick);
  pulse.lastTick = now;
}

// After a gap between beats, report for how long this page itself stood still.
function reportGap(page) {
  recordStandstill();
  if (performance.now() - pulse.beat > REPORTED_GAP)
    navigator.sendBeacon(`/presence?page=${page}&stood=${pulse.standstill / 1000}`);
  pulse.standstill = 0;
}

// Call a function with NiceGUI's socket as soon as there is one.
function withSocket(callback) {
  if (window.socket) callback(window.socket);
  else setTimeout(withSocket, 20, callback);
}

// Receive the gate's heartbeat; reconnect after an error or a timeout.
function watchGate(gate) {
  const source = new EventSource(`${gate}/pulse`, { withCredentials: true });
  const reconnect = () => {
    clearTimeout(timer);
    source.close();
    setTimeout(watchGate, 500, gate);
  };
  let timer = setTimeout(reconnect, GATE_TIMEOUT);
  source.onmessage = () => {
    pulse.gate = performance.now();
    clearTimeout(timer);
    timer = setTimeout(reconnect, GATE_TIMEOUT);
  };
  source.onerror = reconnect;
}

function isCutOff() {
  return performance.now() - pulse.beat > BEAT_TIMEOUT;
}

// Close a socket that has received nothing for long, so that it reconnects: a network that is cut
// closes no connection.
function closeSilentSocket() {
  const lastReceived = Math.max(pulse.beat, pulse.connected);
  if (window.socket?.connected && performance.now() - lastReceived > SOCKET_TIMEOUT) window.socket.io.engine.close();
}

// Show whether the page is cut off, and the age of its pictures.
function updateStatus() {
  const now = performance.now();
  const cutOff = isCutOff();
  // (The gate's messages may still arrive where nothing reaches the gate any more.)
  const stopDead = cutOff && (pulse.failed || now - pulse.gate > BEAT_TIMEOUT);
  const body = document.body;
  body.classList.toggle("cut-off", cutOff);
  body.classList.toggle("stop-dead", stopDead);
  for (const element of document.querySelectorAll(".desk, .bar > :not(.stop)")) element.inert = cutOff;
  const alarm = document.querySelector(".alarm");
  if (cutOff && alarm) {
    const old = Math.round((now - pulse.beat) / 1000);
    const stop = stopDead ? "Nothing is sent." : "Nothing but STOP is sent.";
    alarm.textContent = `Cut off: what is shown is ${old} s old. ${stop}`;
  }
  const clockOffset = Math.min(...pulse.clocks); // ms, of this page's clock to the tracker's
  for (const picture of document.querySelectorAll(".picture")) {
    picture.querySelector("img").alt = ""; // the camera's frame around it has a label
    const taken = parseFloat(picture.dataset.taken);
    const age = now - clockOffset - 1000 * taken;
    const label = picture.querySelector(".age");
    label.textContent = isFinite(age) ? (age < 1000 ? `${age.toFixed(0)} ms old` : `${(age / 1000).toFixed(1)} s old`) : "";
    label.classList.toggle("stale", age > 1000);
  }
}

// Stop the arm on both channels at once; repeat until one of them succeeds.
async function stopArm(gate) {
  if (pulse.stopping) return;
  pulse.stopping = true;
  document.body.classList.add("stopping");
  let why = null;
  while (why === null) {
    try {
      why = await Promise.any([stopByGate(gate), stopBySocket()]);
    } catch {
      pulse.failed = true;
      await new Promise((done) => setTimeout(done, 200));
    }
  }
  pulse.stopping = pulse.failed = false;
  document.body.classList.remove("stopping");
  if (why) warn(why);
}

function warn(why) {
  Quasar.Notify.create({ message: why, type: "warning", position: "bottom", timeout: 6000 });
}

async function stopByGate(gate) {
  const request = { method: "POST", credentials: "include", signal: AbortSignal.timeout(1000) };
  const answer = await fetch(`${gate}/stop`, request);
  if (!answer.ok) throw new Error(answer.status);
  return answer.text();
}

function stopBySocket() {
  return new Promise((done, fail) => {
    if (!window.socket?.connected) throw new Error("cut off");
    window.socket.timeout(1000).emit("stop", (error, why) => (error ? fail(error) : done(why)));
  });
}
