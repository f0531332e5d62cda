// Sections over time, and the coverage curve. Both have the time of the scrub bar below; what
// lies behind the moment shown is pale.

const LEFT = 46, RIGHT = 12;

function timeScale(width) {
  const without = run.failureFree ? run.failureFree.end_ms : 0;
  const last = Math.max(60000, run.lastMs, workBoundMs() || 0, without);
  return { last, x: (ms) => LEFT + (width - LEFT - RIGHT) * ms / last, ms: (x) => (x - LEFT) / (width - LEFT - RIGHT) * last };
}

function workBoundMs() {
  const scene = run.scenes[0];
  return scene ? scene.work_bound_ms : null;
}

function ticks(g, scale, h) {
  const steps = [10, 30, 60, 120, 300, 600, 1200, 1800, 3600].map((s) => s * 1000);
  const step = steps.find((s) => scale.x(s) - scale.x(0) > 46) || 7200000;
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "center";
  for (let ms = 0; ms <= scale.last; ms += step) {
    g.strokeStyle = css("--line");
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(scale.x(ms), 0);
    g.lineTo(scale.x(ms), h - 16);
    g.stroke();
    g.fillStyle = css("--dim");
    g.fillText(clock(ms), scale.x(ms), h - 4);
  }
  g.textAlign = "left";
}

function cursor(g, scale, h) {
  g.fillStyle = css("--panel");
  g.globalAlpha = 0.62;
  const x = scale.x(play.ms), end = scale.x(scale.last);
  if (end > x) g.fillRect(x, 0, end - x + 1, h - 16);
  g.globalAlpha = 1;
  g.strokeStyle = css("--accent");
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, 0);
  g.lineTo(x, h - 16);
  g.stroke();
}

function drawGantt(uavs) {
  const [g, w, h] = sized(el("gantt"));
  if (!uavs.length || h < 30) return;
  const scale = timeScale(w), high = (h - 18) / uavs.length, thick = Math.max(1, Math.min(16, high * 0.72));
  ticks(g, scale, h);
  const y = new Map(uavs.map((u, i) => [u.id, 1 + high * (i + 0.5)]));
  for (const uav of uavs) {
    const mid = y.get(uav.id);
    for (const part of run.stretches.get(uav.id) || []) {
      const x = scale.x(part.from), wide = Math.max(1, scale.x(part.to) - x);
      const working = part.state === "working";
      g.globalAlpha = uav.id === selected || !selected ? 1 : 0.4;
      if (isDead(part.state)) {
        g.fillStyle = css("--bad");
        g.fillRect(x, mid - 0.5, wide, 1);
        continue;
      }
      g.globalAlpha *= working ? 1 : 0.25;
      g.fillStyle = part.state === "starting" ? css("--dim") : colourOf(uav.id);
      const t = working ? thick : thick * 0.5;
      g.fillRect(x, mid - t / 2, wide, t);
    }
    g.globalAlpha = 1;
    if (high >= 9 || uav.id === selected || (uav.id % Math.ceil(11 / high)) === 1) {
      g.font = "11px system-ui, sans-serif";
      g.fillStyle = uav.id === selected ? css("--accent") : css("--dim");
      g.textAlign = "right";
      g.fillText(nameOf(uav.id), LEFT - 5, Math.max(8, mid + 4));
      g.textAlign = "left";
    }
  }
  marks(g, scale, y, Math.min(5, Math.max(2.5, high / 2)));
  cursor(g, scale, h);
}

// Kills, restarts and takeovers: of those that happened up to the moment shown.
function marks(g, scale, y, size) {
  for (const mark of standing.marks) {
    const x = scale.x(mark.t), at = y.get(mark.uav);
    if (at === undefined) continue;
    if (mark.kind === "takeover") {
      const from = y.get(mark.from);
      if (from === undefined) continue;
      g.globalAlpha = selected && selected !== mark.uav && selected !== mark.from ? 0.15 : 0.9;
      g.strokeStyle = g.fillStyle = css("--ink");
      g.lineWidth = 1.2;
      g.beginPath();
      g.moveTo(x, from);
      g.lineTo(x, at);
      g.stroke();
      const d = at > from ? -1 : 1;
      g.beginPath();
      g.moveTo(x, at);
      g.lineTo(x - 3.5, at + 6 * d);
      g.lineTo(x + 3.5, at + 6 * d);
      g.fill();
    } else if (mark.kind === "ended") {
      g.globalAlpha = 1;
      g.strokeStyle = css("--bad");
      g.lineWidth = 2;
      g.beginPath();
      g.moveTo(x - size, at - size); g.lineTo(x + size, at + size);
      g.moveTo(x - size, at + size); g.lineTo(x + size, at - size);
      g.stroke();
    } else {
      g.globalAlpha = 1;
      g.fillStyle = css("--good");
      g.beginPath();
      g.moveTo(x, at - size); g.lineTo(x + size, at + size); g.lineTo(x - size, at + size);
      g.fill();
    }
  }
  g.globalAlpha = 1;
}

function drawCurve() {
  const [g, w, h] = sized(el("curve"));
  if (!run.frames.length || h < 30) return;
  const scale = timeScale(w), base = h - 18, y = (share) => base - (base - 8) * share;
  ticks(g, scale, h);
  g.fillStyle = css("--dim");
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "right";
  for (const share of [0, 0.5, 1]) g.fillText(share * 100 + " %", LEFT - 5, y(share) + 4);
  g.textAlign = "left";
  const scene = run.scenes[0];
  bound(g, scale, y, scene.work_bound_ms, "work bound", [5, 4]);
  if (run.failureFree) without(g, scale, y, run.failureFree.coverage);
  g.strokeStyle = css("--accent");
  g.lineWidth = 2;
  g.beginPath();
  const step = Math.max(1, Math.floor(run.frames.length / w));
  for (let i = 0; i < run.frames.length; i += step) {
    const frame = run.frames[i];
    if (i === 0) g.moveTo(scale.x(frame.t), y(frame.s)); else g.lineTo(scale.x(frame.t), y(frame.s));
  }
  g.stroke();
  for (const mark of standing.marks.filter((m) => m.kind === "ended")) {
    g.strokeStyle = css("--bad");
    g.lineWidth = 1;
    g.beginPath();
    g.moveTo(scale.x(mark.t), y(0));
    g.lineTo(scale.x(mark.t), y(1));
    g.stroke();
  }
  cursor(g, scale, h);
}

// The straight line of who would cover evenly and be done then.
function bound(g, scale, y, ms, name, dash) {
  if (!ms) return;
  g.strokeStyle = g.fillStyle = css("--dim");
  g.setLineDash(dash);
  g.lineWidth = 1.2;
  g.beginPath();
  g.moveTo(scale.x(0), y(0));
  g.lineTo(scale.x(ms), y(1));
  g.lineTo(scale.x(ms), y(0));
  g.stroke();
  g.setLineDash([]);
}

// The curve of the same run without failures.
function without(g, scale, y, points) {
  g.strokeStyle = css("--good");
  g.lineWidth = 1.5;
  g.setLineDash([2, 2]);
  g.beginPath();
  points.forEach(([ms, share], i) => {
    if (i === 0) g.moveTo(scale.x(ms), y(share)); else g.lineTo(scale.x(ms), y(share));
  });
  g.stroke();
  g.setLineDash([]);
}

// The share that was covered by then without failures.
function shareWithout(ms) {
  const points = run.failureFree.coverage;
  let share = 0;
  for (const [at, by] of points) {
    if (at > ms) break;
    share = by;
  }
  return share;
}

function withoutNote() {
  if (!run.failureFree) {
    const knows = run.hello && run.hello.knowledge !== "swarm" && run.hello.mode !== "replay" && !run.end;
    return knows ? "without failures: not reckoned yet" : "without failures: not known";
  }
  const over = run.failureFree.makespan_ms;
  return "dotted: without failures " + (shareWithout(play.ms) * 100).toFixed(1) + " % by then"
    + (over === null ? "" : ", done at " + clock(over));
}

function drawNotes() {
  const bound = workBoundMs(), share = frameAt(play.ms), parts = [];
  if (share) parts.push(share.n[0] + " of " + share.n[1] + " cells");
  if (bound) parts.push("dashed: work bound " + clock(bound));
  parts.push(withoutNote());
  say(el("curve-note"), parts.join("; "));
  say(el("gantt-note"), "✕ gone, ▲ back, → takeover; click to go there");
}
