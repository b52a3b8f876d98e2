// The page's pulse: whether it is cut off, and a STOP that has two ways to the tracker.

const CUT_OFF = 800; // ms without a beat, after which what is on the screen is old
const GATE_SILENCE = 3000; // ms after which a connection to the gate is given up, though not closed
const SOCKET_SILENCE = 5000; // the same of the page's own: engine.io itself waits for half a minute
const RECONNECTION = 1000; // ms between two tries at most: a page's process is soon replaced
const PATIENCE = 10000; // ms for the first beat
const AWAY = 1500; // ms without a beat, after which it is told on which side that was
const CLOCK_BEATS = 40; // that tell how the clocks differ

const pulse = { beat: performance.now() + PATIENCE, gate: -Infinity, connected: -Infinity, pressed: -Infinity, looked: performance.now(), stood: 0, clocks: [], stopping: false, failed: false };

// Follow the pulse; gatePort: of the gate of STOP; page: its name there.
function beginPulse(gatePort, page) {
  tellPresence(page);
  const gate = `${location.protocol}//${location.hostname}:${gatePort}`;
  listenToGate(gate);
  withSocket((socket) => {
    socket.on("beat", (t) => {
      tellAway(page);
      pulse.beat = performance.now();
      pulse.clocks = [...pulse.clocks, pulse.beat - 1000 * t].slice(-CLOCK_BEATS);
      socket.volatile.emit("echo", t);
      look();
    });
    socket.on("connect", () => (pulse.connected = performance.now()));
    socket.io.reconnectionDelayMax(RECONNECTION);
    // What was pressed while it was cut off is not sent on. It is told: one may not have seen it yet.
    socket.io.on("reconnect", () => {
      socket.sendBuffer = [];
      if (pulse.pressed > pulse.beat) warn("the page was cut off when this was pressed; look, then do it again");
    });
  });
  setInterval(() => {
    noteStanding();
    look();
  }, 100);
  setInterval(endSilence, 1000);

  const pressed = (event) => event.target.closest?.(".stop");
  addEventListener("pointerdown", (event) => {
    if (!pressed(event)) pulse.pressed = performance.now();
    else if (event.button === 0) stopArm(gate);
  }, true);
  // (By keys, and by what reads pages aloud; after a pointer it is pressed already.)
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

// Tell whether the page is seen, sleeps or is closed: then it is known why nothing comes from it.
function tellPresence(page) {
  let closed = false; // closing, it is hidden, too
  const tell = (word) => closed || navigator.sendBeacon(`/presence?page=${page}&word=${word}`);
  const tellNow = () => tell(document.visibilityState);
  document.addEventListener("visibilitychange", tellNow);
  document.addEventListener("freeze", () => tell("asleep"));
  document.addEventListener("resume", tellNow);
  addEventListener("pagehide", () => {
    tell("closed");
    closed = true;
  });
  addEventListener("pageshow", () => {
    closed = false;
    tellNow();
  });
  withSocket((socket) => socket.on("connect", tellNow));
}

// Note for how long this page itself stood still since the last beat, ms.
function noteStanding() {
  const now = performance.now();
  pulse.stood = Math.max(pulse.stood, now - pulse.looked);
  pulse.looked = now;
}

// Once beats come again after a while without, tell whether it was this page that stood still.
function tellAway(page) {
  noteStanding();
  if (performance.now() - pulse.beat > AWAY)
    navigator.sendBeacon(`/presence?page=${page}&stood=${pulse.stood / 1000}`);
  pulse.stood = 0;
}

function withSocket(then) {
  if (window.socket) then(window.socket);
  else setTimeout(withSocket, 20, then);
}

// Hear the gate's signs of life, again and again.
function listenToGate(gate) {
  const source = new EventSource(`${gate}/pulse`, { withCredentials: true });
  const anew = () => {
    clearTimeout(silence);
    source.close();
    setTimeout(listenToGate, 500, gate);
  };
  let silence = setTimeout(anew, GATE_SILENCE);
  source.onmessage = () => {
    pulse.gate = performance.now();
    clearTimeout(silence);
    silence = setTimeout(anew, GATE_SILENCE);
  };
  source.onerror = anew;
}

function isCutOff() {
  return performance.now() - pulse.beat > CUT_OFF;
}

// Connect anew where nothing has come for long: a network may have lost the connection, and closed none.
function endSilence() {
  const heard = Math.max(pulse.beat, pulse.connected);
  if (window.socket?.connected && performance.now() - heard > SOCKET_SILENCE) window.socket.io.engine.close();
}

// Show whether the page is cut off, and how old its pictures are.
function look() {
  const now = performance.now();
  const off = isCutOff();
  // (What the gate says may still come where nothing gets to it any more.)
  const dead = off && (pulse.failed || now - pulse.gate > CUT_OFF);
  const body = document.body;
  body.classList.toggle("cut-off", off);
  body.classList.toggle("stop-dead", dead);
  for (const element of document.querySelectorAll(".desk, .bar > :not(.stop)")) element.inert = off;
  const alarm = document.querySelector(".alarm");
  if (off && alarm) {
    const old = Math.round((now - pulse.beat) / 1000);
    const stop = dead ? "Nothing is sent." : "Nothing but STOP is sent.";
    alarm.textContent = `Cut off: what is shown is ${old} s old. ${stop}`;
  }
  const clock = Math.min(...pulse.clocks);
  for (const picture of document.querySelectorAll(".picture")) {
    picture.querySelector("img").alt = ""; // the frame has its name
    const taken = parseFloat(picture.dataset.taken);
    const age = now - clock - 1000 * taken;
    const label = picture.querySelector(".age");
    label.textContent = isFinite(age) ? (age < 1000 ? `${age.toFixed(0)} ms old` : `${(age / 1000).toFixed(1)} s old`) : "";
    label.classList.toggle("stale", age > 1000);
  }
}

// Stop the arm, by whatever way gets through, and be it as soon as one does.
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
  const how = { method: "POST", credentials: "include", signal: AbortSignal.timeout(1000) };
  const answer = await fetch(`${gate}/stop`, how);
  if (!answer.ok) throw new Error(answer.status);
  return answer.text();
}

function stopBySocket() {
  return new Promise((done, fail) => {
    if (!window.socket?.connected) throw new Error("cut off");
    window.socket.timeout(1000).emit("stop", (error, why) => (error ? fail(error) : done(why)));
  });
}
