// Roster, events, rounds, and the card of the UAV that is selected.

const el = (id) => document.getElementById(id);
let selected = 0;

// Writes a text only where it differs: a page that is looked at is not laid out anew.
function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

const WORDS = {
  starting: "starting", standing: "ground", working: "working", idle: "idle", finished: "returning",
  home: "home", silent: "silent", computer_dead: "no computer", lost: "lost",
};

// A swarm cannot tell a lost UAV from one that nobody hears.
function wordOf(state) {
  if (state === "lost" && run.hello && run.hello.knowledge === "swarm") return "held gone";
  return WORDS[state] || state;
}

function drawFacts(frame, uavs) {
  if (!frame) return;
  say(el("fact-time"), clock(play.ms));
  say(el("fact-covered"), (frame.s * 100).toFixed(1) + " %");
  const alive = uavs.filter((u) => !isDead(u.state)).length;
  say(el("fact-alive"), alive + " of " + uavs.length);
  say(el("fact-parts"), String(frame.c.length));
  say(el("fact-orphans"), String(standing.nOrphans()));
  const over = run.end && play.ms >= run.end.t - 600;
  el("verdict").hidden = !over;
  if (over) {
    const report = run.end.report;
    const made = report.makespan_ms ? " in " + clock(report.makespan_ms) : "";
    say(el("fact-verdict"), (report.passed ? "passed" : "failed") + made);
    el("fact-verdict").className = report.passed ? "passed" : "failed";
    el("verdict").title = (report.reasons || []).join("; ");
  }
}

// The least distance to another UAV up to a moment, by UAV.
const least = { n: 0, of: new Map() };
function leastUpTo(ms) {
  const n = upTo(run.frames, ms);
  if (n < least.n) { least.n = 0; least.of = new Map(); }
  for (; least.n < n; least.n += 1) {
    for (const row of run.frames[least.n].u) {
      const near = row[FRAME.near];
      if (near !== null && !(least.of.get(row[0]) <= near)) least.of.set(row[0], near);
    }
  }
  return least.of;
}

function rowOf(id) {
  const body = el("rows");
  let row = body.querySelector('[data-uav="' + id + '"]');
  if (row) return row;
  row = body.insertRow();
  row.dataset.uav = id;
  row.addEventListener("click", () => select(selected === id ? 0 : id));
  const name = row.insertCell();
  const dot = document.createElement("i");
  dot.className = "dot";
  dot.style.background = colourOf(id);
  name.append(dot, document.createTextNode(nameOf(id)));
  for (const of of ["state", "fuel", "near", "left", "took", "down"]) row.insertCell().className = of;
  return row;
}

function drawRoster(uavs) {
  const nearest = leastUpTo(play.ms);
  for (const uav of uavs) {
    const row = rowOf(uav.id);
    const dead = isDead(uav.state);
    row.classList.toggle("dead", dead);
    row.classList.toggle("selected", uav.id === selected);
    const [, state, fuel, near, left, took, down] = row.cells;
    say(state, wordOf(uav.state));
    say(fuel, uav.fuel === null ? "" : uav.fuel + " s");
    const min = nearest.get(uav.id);
    say(near, uav.near === null ? (min === undefined ? "" : "– / " + Math.round(min)) : Math.round(uav.near) + " / " + Math.round(min));
    say(left, dead ? "" : String(uav.left));
    const of = [...(standing.took.get(uav.id) || [])];
    say(took, of.map(([from, n]) => n + " of " + nameOf(from)).join(", "));
    took.classList.toggle("took", true);
    say(down, uav.down.length ? uav.down.length > 2 ? uav.down.length + " peers" : uav.down.join(" ") : "");
    down.classList.toggle("bad", uav.down.length > 0 && !dead);
  }
  const shown = el("rows").rows;
  for (let i = shown.length - 1; i >= 0; i -= 1) {
    if (!uavs.some((u) => u.id === Number(shown[i].dataset.uav))) shown[i].remove();
  }
}

// What a person does not want to read each time it happens.
const NOISE = new Set(["covered", "claim", "bids", "membership", "round", "ready", "booted", "finished"]);
const ORIGINS = { peer: "swarm", world: "world", run: "run" };
const MAX_EVENTS = 400;
let eventsKey = "";

function worthALine(event) {
  if (!NOISE.has(event.kind)) return true;
  if (event.kind === "membership") return event.belief === "down";
  return event.kind === "booted" && event.incarnation > 1;
}

function drawEvents() {
  const n = upTo(run.events, play.ms), every = el("all-events").checked;
  const key = n + " " + every + " " + selected;
  if (key === eventsKey) return;
  eventsKey = key;
  const lines = [];
  for (let i = n - 1; i >= 0 && lines.length < MAX_EVENTS; i -= 1) {
    const event = run.events[i];
    if (!every && !worthALine(event)) continue;
    if (selected && event.uav !== selected && event.from !== selected && event.of !== selected) continue;
    const line = document.createElement("li");
    line.className = event.kind;
    line.dataset.kind = event.kind;
    const time = document.createElement("time");
    time.textContent = clock(event.t);
    const by = document.createElement("i");
    by.className = "by " + ORIGINS[event.origin];
    by.title = { peer: "a peer says so", world: "the world says so", run: "the run says so" }[event.origin];
    const text = document.createElement("span");
    text.textContent = event.text;
    line.append(time, by, text);
    line.addEventListener("click", () => seek(event.t));
    lines.push(line);
  }
  el("event-list").replaceChildren(...lines);
}

// The card: what the selected UAV is, and what may be done to it.
const card = { of: null, state: null, cutFrom: 0 };

function button(text, act, sure) {
  const node = document.createElement("button");
  node.textContent = text;
  node.addEventListener("click", () => {
    if (sure && !node.classList.contains("sure")) {
      node.classList.add("sure");
      node.textContent = text + ": sure?";
      setTimeout(() => { node.classList.remove("sure"); node.textContent = text; }, 3000);
      return;
    }
    act();
  });
  return node;
}

const mayInject = () => Boolean(token) && run.hello && (run.hello.mode === "trial" || run.hello.mode === "watch") && !run.end;

function drawCard(uavs) {
  const uav = uavs.find((u) => u.id === selected);
  const key = [selected, uav && uav.state, mayInject(), card.cutFrom].join();
  const facts = el("card").querySelector(".facts");
  if (key === card.of && facts) { say(facts, uav ? factsOf(uav) : ""); return; }
  card.of = key;
  el("card").hidden = !uav && !mayInject();
  const parts = [];
  const said = el("card").querySelector("output") || document.createElement("output");
  if (uav) {
    const head = document.createElement("b");
    head.textContent = nameOf(uav.id) + ", " + wordOf(uav.state);
    const line = document.createElement("div");
    line.className = "facts small";
    line.textContent = factsOf(uav);
    parts.push(head, line);
  }
  if (mayInject()) {
    const actions = document.createElement("div");
    actions.className = "actions";
    if (uav) {
      const peer = uav.id;
      if (!isDead(uav.state)) {
        actions.append(button("Kill", () => inject({ kind: "kill", peer }), true));
        actions.append(button("Kill computer", () => inject({ kind: "kill-computer", peer }), true));
        actions.append(button("Pause", () => inject({ kind: "pause", peer })));
        actions.append(button("Resume", () => inject({ kind: "resume", peer })));
        const cut = card.cutFrom === peer ? "Cut: now click the other UAV" : "Cut a link …";
        actions.append(button(cut, () => { card.cutFrom = card.cutFrom === peer ? 0 : peer; }));
      } else actions.append(button("Restart", () => inject({ kind: "restart", peer })));
    }
    const half = uavs.filter((u) => !isDead(u.state)).map((u) => u.id);
    actions.append(button("Partition in halves", () => inject({ kind: "partition", groups: [half.slice(0, half.length / 2)] }), true));
    actions.append(button("Heal", () => inject({ kind: "heal" })));
    for (const percent of [0, 20]) actions.append(button("Loss " + percent + " %", () => inject({ kind: "loss", permille: percent * 10 })));
    parts.push(actions);
  }
  parts.push(said);
  el("card").replaceChildren(...parts);
}

function factsOf(uav) {
  const scene = sceneAt(play.ms);
  const spec = scene && scene.uavs.find((u) => u.id === uav.id);
  const facts = [];
  if (uav.e !== null) {
    const links = frameAt(play.ms).l.filter((l) => l.includes(uav.id)).length;
    facts.push(Math.round(uav.e) + " m east", Math.round(uav.n) + " m north",
      "heading " + Math.round(uav.heading) + "°", links + " links");
  }
  if (spec) facts.push("flies at " + Math.round(spec.height_m) + " m");
  return facts.join(", ");
}

async function inject(fault) {
  const out = el("card").querySelector("output");
  try {
    const answer = await fetch("/fault", {
      method: "POST",
      headers: { "content-type": "application/json", "x-skein-token": token },
      body: JSON.stringify(fault),
    });
    const said = await answer.json();
    out.textContent = said.error ? "refused: " + said.error : said.lines.join("\n");
    out.className = said.error ? "bad" : "";
  } catch (why) {
    out.textContent = "the trial does not answer any more";
    out.className = "bad";
  }
}
