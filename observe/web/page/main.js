// The clock of the page, its keys, and the stream.

const play = { ms: 0, on: true, speed: 8, live: false, dragging: false };

// The token stands behind the # of the address that was printed; it is kept for this tab and
// taken out of sight.
const token = (() => {
  const told = location.hash.slice(1);
  try {
    if (/^[0-9a-zA-Z]+$/.test(told)) {
      sessionStorage.setItem("skein-token", told);
      history.replaceState(null, "", location.pathname + location.search);
      return told;
    }
    return sessionStorage.getItem("skein-token") || "";
  } catch (none) {
    return told;
  }
})();
const wishes = new URLSearchParams(location.search);

function seek(ms) {
  play.live = false;
  play.ms = Math.min(Math.max(0, ms), run.lastMs);
  dirty = true;
}

function select(id) {
  if (card.cutFrom && id && id !== card.cutFrom) {
    inject({ kind: "cut", a: card.cutFrom, b: id });
    card.cutFrom = 0;
  }
  selected = id;
  const row = id && el("rows").querySelector('[data-uav="' + id + '"]');
  if (row) row.scrollIntoView({ block: "nearest" });
  dirty = true;
}

function next(step) {
  const ids = uavsAt(play.ms).map((u) => u.id);
  if (!ids.length) return;
  const at = ids.indexOf(selected);
  select(ids[(at + step + ids.length + (at < 0 && step < 0 ? 1 : 0)) % ids.length]);
}

function theme(to) {
  document.documentElement.dataset.theme = to;
  map.drawn = "";
  dirty = true;
}

function tab(name) {
  for (const of of ["roster", "events", "rounds", "tasks"]) {
    el(of).hidden = of !== name;
    document.querySelector('[data-tab="' + of + '"]').setAttribute("aria-selected", String(of === name));
  }
  dirty = true;
}

function speed(by) {
  const box = el("speed");
  box.selectedIndex = Math.min(box.options.length - 1, Math.max(0, box.selectedIndex + by));
  play.speed = Number(box.value);
}

let dirty = true, last = performance.now(), panelsAt = 0;

function tick(now) {
  const passed = Math.min(250, now - last);
  last = now;
  if (play.live) {
    if (play.ms !== run.lastMs) { play.ms = run.lastMs; dirty = true; }
  } else if (play.on && !play.dragging && play.ms < run.lastMs) {
    play.ms = Math.min(run.lastMs, play.ms + passed * play.speed);
    dirty = true;
  }
  if (dirty) {
    dirty = false;
    draw(now);
  }
  requestAnimationFrame(tick);
}

function draw(now) {
  standing.seek(play.ms);
  const scene = standing.scene;
  if (!scene) return;
  if (!map.scale) fit();
  const uavs = uavsAt(play.ms), frame = frameAt(play.ms);
  drawGround(scene);
  drawAir(scene, uavs, frame);
  if (now - panelsAt < 120 && (play.on || play.live)) {
    dirty = true;
    drawScrub();
    return;
  }
  panelsAt = now;
  drawFacts(frame, uavs);
  if (!el("roster").hidden) drawRoster(uavs);
  if (!el("events").hidden) drawEvents();
  if (!el("rounds").hidden) drawRounds();
  if (!el("tasks").hidden) drawTasks();
  drawCard(uavs);
  drawGantt(uavs);
  drawCurve();
  drawNotes();
  drawScrub();
}

function drawScrub() {
  const bar = el("scrub");
  bar.max = String(Math.max(1, Math.ceil(run.lastMs / 100)));
  if (!play.dragging) bar.value = String(Math.round(play.ms / 100));
  const narrow = window.innerWidth < 600;
  say(el("clock"), clock(play.ms) + (narrow ? "" : " / " + clock(run.lastMs)));
  say(el("play"), play.on && !play.live && play.ms < run.lastMs ? "⏸" : "▶");
  el("live").classList.toggle("on", play.live);
}

function greet(hello) {
  say(el("title"), hello.title);
  document.title = hello.title + " · Skein";
  const modes = { sim: "simulated run", trial: "live trial", watch: "live swarm", replay: "recording" };
  say(el("mode"), modes[hello.mode] || hello.mode);
  say(el("again"), "This again: " + hello.command);
  play.live = hello.mode === "trial" || hello.mode === "watch";
  if (hello.knowledge === "swarm") {
    document.querySelectorAll(".by.world").forEach((node) => { node.className = "by swarm"; });
    document.querySelector(".world-word").textContent = "last heard";
    banner("What the swarm says of itself, as it was heard: nothing here is the truth of a world.");
  }
  const at = wishes.get("t");
  if (at !== null) { play.on = false; play.live = false; }
}

function banner(text) {
  el("banner").hidden = !text;
  say(el("banner"), text);
}

function listen() {
  const stream = new EventSource("/stream");
  stream.onmessage = (message) => {
    let word;
    try { word = JSON.parse(message.data); } catch (broken) { return; }
    const kind = take(word);
    el("waiting").hidden = run.scenes.length > 0;
    if (kind === "hello") { greet(word); map.scale = 0; }
    if (kind === "end") banner(run.hello && run.hello.knowledge === "swarm" ? el("banner").textContent : "");
    const at = wishes.get("t");
    if (at !== null && run.lastMs >= Number(at) * 1000) {
      wishes.delete("t");
      play.ms = Number(at) * 1000;
    }
    dirty = true;
  };
  stream.onopen = () => { if (el("banner").dataset.lost) { delete el("banner").dataset.lost; banner(""); } };
  stream.onerror = () => {
    if (run.end || el("banner").dataset.lost) return;
    el("banner").dataset.lost = "1";
    banner("The program that sends this does not answer; what is shown is what came so far.");
  };
}

function keys(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
  const onBar = event.target.id === "scrub";
  const pan = 60 / map.scale;
  const acts = {
    " ": () => el("play").click(), ",": () => seek(play.ms - 5000), ".": () => seek(play.ms + 5000),
    "[": () => speed(-1), "]": () => speed(1), l: () => { play.live = true; }, "+": () => zoom(1.3), "=": () => zoom(1.3),
    "-": () => zoom(1 / 1.3), 0: fit, n: () => next(1), p: () => next(-1), d: () => el("theme").click(),
    1: () => tab("roster"), 2: () => tab("events"), 3: () => tab("rounds"), 4: () => tab("tasks"), "?": () => el("help").showModal(),
    Escape: () => { card.cutFrom = 0; select(0); },
    ArrowLeft: () => { map.cx -= pan; }, ArrowRight: () => { map.cx += pan; },
    ArrowUp: () => { map.cy += pan; }, ArrowDown: () => { map.cy -= pan; },
  };
  const act = acts[event.key];
  if (!act || el("help").open || (onBar && event.key.startsWith("Arrow"))) return;
  if (event.key === " " && event.target.tagName === "BUTTON") return;
  event.preventDefault();
  act();
  dirty = true;
}

// One finger or the mouse moves the map, two fingers and the wheel zoom it, a click selects.
function pointers() {
  const down = new Map();
  let moved = 0, apart = 0;
  const place = (event) => {
    const box = map.box.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = () => { const [a, b] = [...down.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  map.box.addEventListener("pointerdown", (event) => {
    if (event.target.tagName !== "CANVAS") return;
    map.box.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    moved = 0;
    if (down.size === 2) apart = spread();
  });
  map.box.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    if (map.scale) say(el("place"), where(x, y));
    const was = down.get(event.pointerId);
    if (!was) return;
    down.set(event.pointerId, [x, y]);
    moved += Math.abs(x - was[0]) + Math.abs(y - was[1]);
    if (down.size === 2) {
      const now = spread(), [a, b] = [...down.values()];
      if (apart > 0) zoom(now / apart, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
      apart = now;
    } else {
      map.cx -= (x - was[0]) / map.scale;
      map.cy += (y - was[1]) / map.scale;
    }
    dirty = true;
  });
  const up = (event) => {
    const was = down.get(event.pointerId);
    down.delete(event.pointerId);
    if (event.type === "pointerup" && was && moved < 6) select(uavNear(...place(event)) || 0);
  };
  map.box.addEventListener("pointerup", up);
  map.box.addEventListener("pointercancel", up);
  map.box.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * 0.0015), ...place(event));
    dirty = true;
  }, { passive: false });
}

// Latitude and longitude of a place on the screen, near enough for a label.
function where(x, y) {
  const scene = sceneAt(play.ms);
  if (!scene) return "";
  const e = toE(x), n = toN(y);
  const lat = scene.lat_deg + n / 111320, lon = scene.lon_deg + e / (111320 * Math.cos(scene.lat_deg * Math.PI / 180));
  return lat.toFixed(5) + ", " + lon.toFixed(5) + "  (" + Math.round(e) + " m east, " + Math.round(n) + " m north)";
}

function seekFrom(canvas) {
  const go = (event) => {
    const box = canvas.getBoundingClientRect();
    seek(timeScale(canvas.clientWidth).ms(event.clientX - box.left));
  };
  canvas.addEventListener("pointerdown", go);
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
}

function start() {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  theme(wishes.get("theme") || (dark ? "dark" : "light"));
  el("theme").onclick = () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  el("help-button").onclick = () => el("help").showModal();
  el("zoom-in").onclick = () => { zoom(1.4); dirty = true; };
  el("zoom-out").onclick = () => { zoom(1 / 1.4); dirty = true; };
  el("fit").onclick = () => { fit(); dirty = true; };
  el("live").onclick = () => { play.live = true; dirty = true; };
  el("play").onclick = () => {
    const stopped = play.live || !play.on || play.ms >= run.lastMs;
    if (play.live) { play.live = false; play.on = false; }
    else if (play.ms >= run.lastMs && run.end) { play.ms = 0; play.on = true; }
    else play.on = stopped;
    dirty = true;
  };
  el("speed").onchange = () => { play.speed = Number(el("speed").value); };
  el("scrub").oninput = () => { play.dragging = true; seek(Number(el("scrub").value) * 100); };
  el("scrub").onchange = () => { play.dragging = false; };
  document.querySelectorAll("[data-tab]").forEach((node) => { node.onclick = () => tab(node.dataset.tab); });
  document.querySelectorAll("#layers input, #all-events").forEach((node) => { node.onchange = () => { map.drawn = ""; dirty = true; }; });
  document.addEventListener("keydown", keys);
  new ResizeObserver(() => { map.drawn = ""; dirty = true; }).observe(map.box);
  seekFrom(el("gantt"));
  seekFrom(el("curve"));
  pointers();
  const fast = wishes.get("speed");
  if (fast) { play.speed = Number(fast) || 8; el("speed").value = String(play.speed); }
  if (wishes.get("uav")) selected = Number(wishes.get("uav"));
  if (wishes.get("tab")) tab(wishes.get("tab"));
  listen();
  requestAnimationFrame(tick);
}
start();
