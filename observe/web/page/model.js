// What the page was sent, and how all stands at one moment of it.

const nothing = () => ({
  hello: null, scenes: [], frames: [], events: [], end: null, lastMs: 0, failureFree: null,
  // Rounds and tasks by their numbers, as they are by now: each piece of them has its time.
  rounds: new Map(), tasks: new Map(), told: 0,
  // Of each UAV where it was last each time its airframe was gone, and its stretches of one state.
  gone: new Map(), stretches: new Map(),
});
const run = nothing();

function forget() {
  Object.assign(run, nothing());
  standing.reset();
}

// Takes a word of the stream; returns its kind.
function take(word) {
  switch (word.k) {
    case "hello":
      if (run.hello) forget();
      run.hello = word;
      break;
    case "scene": run.scenes.push(word); break;
    case "frame": note(word); run.frames.push(word); break;
    case "event": run.events.push(word); break;
    case "failure_free": run.failureFree = word; break;
    case "round": keep(run.rounds, word); break;
    case "task": keep(run.tasks, word); break;
    case "end": run.end = word; break;
    default: return word.k;
  }
  if (word.t !== undefined) run.lastMs = Math.max(run.lastMs, word.t);
  return word.k;
}

// As many as the program keeps: the oldest goes first.
const KEPT = 256;

function keep(all, word) {
  all.set(word.id, word);
  run.told += 1;
  if (all.size > KEPT) all.delete(Math.min(...all.keys()));
}

// Keeps of a frame what is looked up often.
function note(frame) {
  const before = run.frames[run.frames.length - 1];
  const rows = new Map(before ? before.u.map((row) => [row[0], row]) : []);
  for (const row of frame.u) {
    const [id, state] = row, was = rows.get(id);
    if (was && was[FRAME.e] !== null && row[FRAME.e] === null) {
      if (!run.gone.has(id)) run.gone.set(id, []);
      run.gone.get(id).push({ t: before.t, e: was[FRAME.e], n: was[FRAME.n] });
    }
    if (!run.stretches.has(id)) run.stretches.set(id, []);
    const all = run.stretches.get(id), last = all[all.length - 1];
    if (last && last.state === state) last.to = frame.t;
    else {
      if (last) last.to = frame.t;
      all.push({ state, from: frame.t, to: frame.t });
    }
  }
}

// How many of a list, which is in the order of time, are not later than that.
function upTo(list, ms) {
  let low = 0, high = list.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (list[mid].t <= ms) low = mid + 1; else high = mid;
  }
  return low;
}

const FRAME = { id: 0, state: 1, e: 2, n: 3, heading: 4, fuel: 5, left: 6, near: 7, failsafe: 8, down: 9 };

function uavOf(row) {
  return {
    id: row[FRAME.id], state: row[FRAME.state], e: row[FRAME.e], n: row[FRAME.n],
    heading: row[FRAME.heading], fuel: row[FRAME.fuel], left: row[FRAME.left],
    near: row[FRAME.near], failsafe: row[FRAME.failsafe] === 1, down: row[FRAME.down],
  };
}

const isDead = (state) => state === "lost" || state === "computer_dead";

// The UAVs of a moment, between the frame before and the one after it.
function uavsAt(ms) {
  const n = upTo(run.frames, ms);
  if (n === 0) return run.frames.length ? run.frames[0].u.map(uavOf) : [];
  const before = run.frames[n - 1], after = run.frames[n];
  const uavs = before.u.map(uavOf);
  if (!after || after.t - before.t > 3000) return uavs;
  const share = (ms - before.t) / (after.t - before.t);
  const next = new Map(after.u.map((row) => [row[FRAME.id], row]));
  for (const uav of uavs) {
    const row = next.get(uav.id);
    if (!row || row[FRAME.e] === null || uav.e === null) continue;
    if (Math.hypot(row[FRAME.e] - uav.e, row[FRAME.n] - uav.n) > 200) continue;
    uav.e += (row[FRAME.e] - uav.e) * share;
    uav.n += (row[FRAME.n] - uav.n) * share;
    const turn = ((row[FRAME.heading] - uav.heading + 540) % 360) - 180;
    uav.heading += turn * share;
  }
  return uavs;
}

function frameAt(ms) {
  const n = upTo(run.frames, ms);
  return run.frames[Math.max(0, n - 1)] || null;
}

function sceneAt(ms) {
  const n = upTo(run.scenes, ms);
  return run.scenes[Math.max(0, n - 1)] || null;
}

// Who has which cell and who took over what, folded from the events; the rules are those of
// `skein_recording::cells`.
const standing = {
  nEvents: 0, scene: null, ms: 0, version: 0,
  reset() {
    this.nEvents = 0; this.scene = null; this.ms = 0;
    this.clear(0);
    this.took = new Map(); this.marks = [];
    this.version += 1;
  },
  clear(nCells) {
    this.covered = new Array(nCells).fill(0);
    this.listed = new Map(); this.held = new Map(); this.orphans = new Map();
  },
  // Brings it to a moment: on from where it was, or anew where that is later.
  seek(ms) {
    if (ms < this.ms) this.reset();
    this.ms = ms;
    const n = upTo(run.events, ms);
    const scenes = run.scenes;
    let i = this.scene ? scenes.indexOf(this.scene) + 1 : 0;
    for (;;) {
      const scene = scenes[i], event = this.nEvents < n ? run.events[this.nEvents] : null;
      if (scene && (i === 0 || scene.t <= ms) && (!event || scene.t <= event.t || i === 0)) {
        this.enter(scene); i += 1; continue;
      }
      if (!event) break;
      this.happen(event);
      this.nEvents += 1;
    }
  },
  enter(scene) {
    const another = !this.scene || this.scene.loop !== scene.loop;
    this.scene = scene;
    if (another) this.clear(scene.cells.length);
    this.version += 1;
  },
  happen(event) {
    const uav = event.uav;
    switch (event.kind) {
      case "claim": {
        for (const cell of event.cells) this.orphans.delete(cell);
        this.listed.set(uav, event.cells);
        this.held.set(uav, event.held);
        this.version += 1;
        break;
      }
      case "covered":
        for (const cell of event.cells) {
          if (this.covered[cell] === 0) this.covered[cell] = uav;
          this.orphans.delete(cell);
        }
        this.version += 1;
        break;
      case "ended": {
        this.listed.delete(uav); this.held.delete(uav);
        for (const cell of event.orphans) this.orphans.set(cell, uav);
        this.marks.push({ t: event.t, kind: "ended", uav, airframe: event.airframe });
        this.version += 1;
        break;
      }
      case "booted":
        if (event.incarnation > 1) this.marks.push({ t: event.t, kind: "booted", uav });
        break;
      case "takeover": {
        const of = this.took.get(uav) || new Map();
        of.set(event.from, (of.get(event.from) || 0) + event.cells.length);
        this.took.set(uav, of);
        this.marks.push({ t: event.t, kind: "takeover", uav, from: event.from });
        break;
      }
    }
  },
  // The owner of each cell that is open: whoever lists it, the lowest number where several do,
  // else whoever gave it away and answers for it.
  owners() {
    const owners = new Map();
    for (const lists of [this.held, this.listed]) {
      const falling = [...lists.keys()].sort((a, b) => b - a);
      for (const uav of falling) for (const cell of lists.get(uav)) owners.set(cell, uav);
    }
    return owners;
  },
  nOrphans() {
    let n = 0;
    for (const cell of this.orphans.keys()) if (!this.covered[cell]) n += 1;
    return n;
  },
};
standing.reset();

// Safe for people who confuse colours (Okabe and Ito), darker and lighter beyond seven.
const PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#b8a800"];
const SHADES = [0, -0.28, 0.34];

function mix(hex, towards, share) {
  const part = (i) => {
    const from = parseInt(hex.slice(i, i + 2), 16);
    return Math.round(from + (towards - from) * share).toString(16).padStart(2, "0");
  };
  return "#" + part(1) + part(3) + part(5);
}

const colours = new Map();
function colourOf(id) {
  if (!colours.has(id)) {
    const nth = Math.max(0, id - 1), shade = SHADES[Math.floor(nth / PALETTE.length) % SHADES.length];
    const base = PALETTE[nth % PALETTE.length];
    colours.set(id, shade === 0 ? base : mix(base, shade < 0 ? 0 : 255, Math.abs(shade)));
  }
  return colours.get(id);
}

function nameOf(id) {
  const scene = run.scenes[run.scenes.length - 1];
  const uav = scene && scene.uavs.find((u) => u.id === id);
  if (uav) return uav.name;
  return scene && scene.ground && scene.ground.id === id ? "ground station" : "uav" + id;
}

function clock(ms) {
  const s = Math.max(0, Math.round(ms / 1000));
  return Math.floor(s / 60) + ":" + String(s % 60).padStart(2, "0");
}
