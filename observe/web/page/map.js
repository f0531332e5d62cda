// The map: what stands still on one canvas, what flies on another one above it.

const map = {
  box: document.getElementById("map"),
  ground: document.getElementById("ground"),
  air: document.getElementById("air"),
  cx: 0, cy: 0, scale: 0, // metres in the middle, pixels per metre
  drawn: "", hatches: new Map(),
};

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function sized(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  return [g, w, h];
}

function extent(scene) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (e, n) => {
    box[0] = Math.min(box[0], e); box[1] = Math.min(box[1], n);
    box[2] = Math.max(box[2], e); box[3] = Math.max(box[3], n);
  };
  const ring = (r) => { for (let i = 0; i + 1 < r.length; i += 2) add(r[i], r[i + 1]); };
  ring(scene.area);
  scene.cells.forEach(ring);
  scene.uavs.forEach((u) => add(u.e, u.n));
  if (scene.ground) add(scene.ground.e, scene.ground.n);
  return Number.isFinite(box[0]) ? box : [-500, -500, 500, 500];
}

function fit() {
  const scene = sceneAt(play.ms);
  if (!scene) return;
  const [w, s, e, n] = extent(scene);
  map.cx = (w + e) / 2;
  map.cy = (s + n) / 2;
  const wide = map.box.clientWidth - 40, high = map.box.clientHeight - 64;
  map.scale = Math.max(1e-4, Math.min(wide / Math.max(1, e - w), high / Math.max(1, n - s)));
  map.drawn = "";
}

const toX = (e) => (e - map.cx) * map.scale + map.box.clientWidth / 2;
const toY = (n) => map.box.clientHeight / 2 - (n - map.cy) * map.scale;
const toE = (x) => (x - map.box.clientWidth / 2) / map.scale + map.cx;
const toN = (y) => (map.box.clientHeight / 2 - y) / map.scale + map.cy;

function zoom(by, x, y) {
  const at = [x === undefined ? map.box.clientWidth / 2 : x, y === undefined ? map.box.clientHeight / 2 : y];
  const e = toE(at[0]), n = toN(at[1]);
  map.scale = Math.min(20, Math.max(0.002, map.scale * by));
  map.cx += e - toE(at[0]);
  map.cy += n - toN(at[1]);
  map.drawn = "";
}

function path(g, ring) {
  for (let i = 0; i + 1 < ring.length; i += 2) {
    if (i === 0) g.moveTo(toX(ring[0]), toY(ring[1]));
    else g.lineTo(toX(ring[i]), toY(ring[i + 1]));
  }
  g.closePath();
}

function hatch(g, colour) {
  if (!map.hatches.has(colour)) {
    const tile = document.createElement("canvas");
    tile.width = tile.height = 8;
    const t = tile.getContext("2d");
    t.strokeStyle = colour;
    t.lineWidth = 1.6;
    t.beginPath();
    for (const d of [-8, 0, 8]) { t.moveTo(d, 8); t.lineTo(d + 8, 0); }
    t.stroke();
    map.hatches.set(colour, g.createPattern(tile, "repeat"));
  }
  return map.hatches.get(colour);
}

function drawGround(scene) {
  const sections = document.getElementById("show-sections").checked;
  const key = [standing.version, map.cx, map.cy, map.scale, map.box.clientWidth, map.box.clientHeight,
    document.documentElement.dataset.theme, selected, sections, scene.t].join();
  if (key === map.drawn) return;
  map.drawn = key;
  const [g] = sized(map.ground);
  g.lineJoin = "round";
  g.fillStyle = css("--field");
  g.strokeStyle = css("--dim");
  g.lineWidth = 1.5;
  g.beginPath();
  path(g, scene.area);
  g.fill();
  g.stroke();
  g.fillStyle = css("--house");
  g.beginPath();
  scene.buildings.forEach((ring) => path(g, ring));
  g.fill();
  drawCells(g, scene, sections);
  g.lineWidth = 1.5;
  for (const zone of scene.zones) {
    g.beginPath();
    path(g, zone.ring);
    g.globalAlpha = 0.16;
    g.fillStyle = css("--zone");
    g.fill();
    g.globalAlpha = 1;
    g.strokeStyle = css("--zone");
    g.setLineDash(zone.added ? [6, 4] : []);
    g.stroke();
    g.setLineDash([]);
  }
  drawPlaces(g, scene);
}

// Cells of one look are filled together: some thousands of them are drawn at each change.
function drawCells(g, scene, sections) {
  const owners = standing.owners();
  const looks = new Map();
  const put = (look, cell) => { if (!looks.has(look)) looks.set(look, []); looks.get(look).push(cell); };
  scene.cells.forEach((_, cell) => {
    const by = standing.covered[cell];
    if (by) put("covered " + by, cell);
    else if (owners.has(cell)) put("planned " + owners.get(cell), cell);
    else if (standing.orphans.has(cell)) put("orphan " + standing.orphans.get(cell), cell);
    else if (scene.needed[cell]) put("open 0", cell);
  });
  for (const [look, cells] of looks) {
    const [kind, of] = look.split(" ");
    const id = Number(of), dimmed = selected && id !== selected;
    g.beginPath();
    cells.forEach((cell) => path(g, scene.cells[cell]));
    if (kind === "open") {
      g.globalAlpha = 0.35;
      g.strokeStyle = css("--dim");
      g.lineWidth = 0.5;
      g.stroke();
    } else if (kind === "covered") {
      g.globalAlpha = dimmed ? 0.3 : 0.8;
      g.fillStyle = colourOf(id);
      g.fill();
    } else if (kind === "planned" && sections) {
      g.globalAlpha = dimmed ? 0.1 : 0.28;
      g.fillStyle = colourOf(id);
      g.fill();
      g.globalAlpha = dimmed ? 0.15 : 0.5;
      g.strokeStyle = colourOf(id);
      g.lineWidth = 0.6;
      g.stroke();
    } else if (kind === "orphan") {
      g.globalAlpha = 1;
      g.fillStyle = hatch(g, css("--bad"));
      g.fill();
      g.strokeStyle = css("--bad");
      g.lineWidth = 1;
      g.stroke();
    }
  }
  g.globalAlpha = 1;
}

function drawPlaces(g, scene) {
  g.strokeStyle = g.fillStyle = css("--ink");
  g.lineWidth = 1.5;
  g.beginPath();
  const [x, y] = [toX(scene.base[0]), toY(scene.base[1])];
  g.arc(x, y, 6, 0, 7);
  g.moveTo(x - 9, y); g.lineTo(x + 9, y);
  g.moveTo(x, y - 9); g.lineTo(x, y + 9);
  g.stroke();
  if (scene.ground) {
    const [gx, gy] = [toX(scene.ground.e), toY(scene.ground.n)];
    g.beginPath();
    g.rect(gx - 5, gy - 5, 10, 10);
    g.fill();
    label(g, "GS", gx + 8, gy + 4);
  }
  // A bar of a round length.
  const metres = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000].find((m) => m * map.scale > 60) || 20000;
  const right = map.box.clientWidth - 12, bottom = map.box.clientHeight - 12;
  g.strokeStyle = css("--ink");
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(right - metres * map.scale, bottom - 4);
  g.lineTo(right - metres * map.scale, bottom);
  g.lineTo(right, bottom);
  g.lineTo(right, bottom - 4);
  g.stroke();
  g.textAlign = "right";
  label(g, metres >= 1000 ? metres / 1000 + " km" : metres + " m", right, bottom - 7);
  g.textAlign = "left";
}

function label(g, text, x, y, bold) {
  g.font = (bold ? "600 " : "") + "12px system-ui, sans-serif";
  g.lineWidth = 3;
  g.strokeStyle = css("--ground");
  g.strokeText(text, x, y);
  g.fillStyle = css("--ink");
  g.fillText(text, x, y);
}

// Which part of a divided swarm each peer is in: A is the largest.
function partsOf(frame) {
  const parts = new Map();
  if (!frame || frame.c.length < 2) return parts;
  const large = [...frame.c].sort((a, b) => b.length - a.length);
  large.forEach((part, i) => part.forEach((id) => parts.set(id, i < 26 ? String.fromCharCode(65 + i) : "·")));
  return parts;
}

function drawAir(scene, uavs, frame) {
  const [g] = sized(map.air);
  const at = new Map(uavs.filter((u) => u.e !== null).map((u) => [u.id, [toX(u.e), toY(u.n)]]));
  if (scene.ground) at.set(scene.ground.id, [toX(scene.ground.e), toY(scene.ground.n)]);
  if (document.getElementById("show-links").checked && frame) drawLinks(g, at, frame);
  if (document.getElementById("show-trails").checked) drawTrails(g, uavs);
  const parts = partsOf(frame);
  const many = uavs.length > 30 && map.scale < 0.5;
  for (const uav of uavs) {
    const dead = isDead(uav.state);
    const place = at.get(uav.id) || lastPlace(uav.id);
    if (!place) continue;
    g.globalAlpha = selected && selected !== uav.id ? 0.55 : 1;
    if (dead) cross(g, place, uav.state === "computer_dead" ? uav : null);
    else arrow(g, place, uav, many ? 6 : 9);
    if (uav.down.length && !dead) ring(g, place, 15, css("--bad"), [3, 3]);
    if (uav.failsafe && !dead) ring(g, place, 12, css("--dim"), [2, 2]);
    if (uav.id === selected) ring(g, place, 18, css("--accent"), []);
    if (!many || uav.id === selected || dead) {
      const part = parts.get(uav.id);
      label(g, uav.id + (part ? " " + part : ""), place[0] + 10, place[1] - 8, true);
    }
    g.globalAlpha = 1;
  }
}

function drawLinks(g, at, frame) {
  const parts = partsOf(frame);
  g.strokeStyle = css("--link");
  const alpha = frame.l.length > 400 ? 0.1 : frame.l.length > 60 ? 0.22 : 0.4;
  for (const [a, b] of frame.l) {
    const from = at.get(a), to = at.get(b);
    if (!from || !to) continue;
    const own = selected === a || selected === b;
    g.globalAlpha = own ? 0.95 : selected ? alpha / 2 : alpha;
    g.lineWidth = own ? 1.8 : 1;
    const part = parts.get(a);
    g.setLineDash(part && part !== "A" ? [5, 4] : []);
    g.beginPath();
    g.moveTo(from[0], from[1]);
    g.lineTo(to[0], to[1]);
    g.stroke();
  }
  g.setLineDash([]);
  g.globalAlpha = 1;
}

const TRAIL_MS = 45000;

function drawTrails(g, uavs) {
  const n = upTo(run.frames, play.ms);
  const from = Math.max(0, upTo(run.frames, play.ms - TRAIL_MS));
  const step = uavs.length > 30 ? 3 : 1;
  uavs.forEach((uav, row) => {
    if (uav.e === null) return;
    g.strokeStyle = colourOf(uav.id);
    g.globalAlpha = selected && selected !== uav.id ? 0.15 : 0.75;
    g.lineWidth = uav.id === selected ? 2.5 : 1.4;
    g.beginPath();
    let on = false;
    for (let i = from; i < n; i += step) {
      const r = run.frames[i].u[row];
      if (!r || r[FRAME.id] !== uav.id || r[FRAME.e] === null) { on = false; continue; }
      if (on) g.lineTo(toX(r[FRAME.e]), toY(r[FRAME.n])); else g.moveTo(toX(r[FRAME.e]), toY(r[FRAME.n]));
      on = true;
    }
    if (on) g.lineTo(toX(uav.e), toY(uav.n));
    g.stroke();
  });
  g.globalAlpha = 1;
}

// Where an airframe was last that is gone.
function lastPlace(id) {
  const gone = run.gone.get(id) || [];
  const n = upTo(gone, play.ms);
  return n ? [toX(gone[n - 1].e), toY(gone[n - 1].n)] : null;
}

function arrow(g, [x, y], uav, size) {
  const a = (uav.heading || 0) * Math.PI / 180;
  const tip = (along, across) => [x + Math.sin(a) * along + Math.cos(a) * across, y - Math.cos(a) * along + Math.sin(a) * across];
  g.beginPath();
  [[size * 1.3, 0], [-size, size * 0.85], [-size * 0.45, 0], [-size, -size * 0.85]].forEach(([along, across], i) => {
    const [px, py] = tip(along, across);
    if (i === 0) g.moveTo(px, py); else g.lineTo(px, py);
  });
  g.closePath();
  g.strokeStyle = css("--field");
  g.lineWidth = 4;
  g.stroke();
  g.fillStyle = colourOf(uav.id);
  g.fill();
  g.strokeStyle = css("--ink");
  g.lineWidth = 1.5;
  g.stroke();
}

function cross(g, [x, y], flying) {
  if (flying) arrow(g, [x, y], flying, 8);
  g.strokeStyle = css("--bad");
  g.lineWidth = 2.6;
  g.beginPath();
  g.moveTo(x - 7, y - 7); g.lineTo(x + 7, y + 7);
  g.moveTo(x - 7, y + 7); g.lineTo(x + 7, y - 7);
  g.stroke();
}

function ring(g, [x, y], radius, colour, dash) {
  g.strokeStyle = colour;
  g.lineWidth = 1.8;
  g.setLineDash(dash);
  g.beginPath();
  g.arc(x, y, radius, 0, 7);
  g.stroke();
  g.setLineDash([]);
}

// The UAV nearest to a place of the screen, if one is near.
function uavNear(x, y) {
  let best = null, least = 22;
  for (const uav of uavsAt(play.ms)) {
    const place = uav.e === null ? lastPlace(uav.id) : [toX(uav.e), toY(uav.n)];
    if (!place) continue;
    const off = Math.hypot(place[0] - x, place[1] - y);
    if (off < least) { least = off; best = uav.id; }
  }
  return best;
}
