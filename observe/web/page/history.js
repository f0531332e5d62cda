// How the swarm came to who does what: rounds with their bids, and the history of each task. The
// program sends each as it is by now; what came later than the moment shown is left out here.

const MAX_SHOWN = 100;
const told = (list, ms) => list.filter((of) => of.time_ms <= ms);

function node(tag, text, name) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
}

// A time that leads there.
function moment(ms) {
  const made = node("button", clock(ms), "moment");
  made.title = "go to that moment";
  made.addEventListener("click", () => seek(ms));
  return made;
}

const seconds = (ms) => (ms / 1000).toFixed(0) + " s";

// A section: stretches of the loop in the order of flight.
function section(got) {
  const parts = got.stretches.map(([from, to]) => (from === to ? String(from) : from + "→" + to));
  const more = parts.length > 4 ? ", …" : "";
  return parts.slice(0, 4).join(", ") + more;
}

function whyOf(round) {
  if (round.repair === null) return "";
  return round.repair ? "cells that nobody lists" : "to even out the work";
}

// What came of a round by then: later rounds of the same members take its place.
function outcomeOf(round, got, ms) {
  if (got.length === round.members.length) return "all adopted it";
  if (got.length) return got.length + " of " + round.members.length + " adopted it";
  const later = [...run.rounds.values()].find((other) => other.id > round.id && other.opened_ms <= ms
    && other.members.some((m) => round.members.includes(m)));
  if (later) return "nobody adopted it: round " + later.counter + " followed";
  return "open";
}

// Redraws a list only where something of it changed.
function redraw(list, key, make) {
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.replaceChildren(...make());
}

function drawRounds() {
  const rounds = [...run.rounds.values()].filter((r) => r.opened_ms <= play.ms)
    .filter((r) => !selected || r.members.includes(selected)).sort((a, b) => b.id - a.id).slice(0, MAX_SHOWN);
  const n = (r) => r.id + ":" + told(r.bids, play.ms).length + ":" + told(r.got, play.ms).length;
  redraw(el("round-list"), selected + " " + rounds.map(n).join(), () => {
    if (rounds.length) return rounds.map(roundNode);
    return [node("p", selected ? nameOf(selected) + " was in no round by then."
      : "No round by then: each UAV begins with a section that it takes by itself. Swarms of more than eight take and relieve without rounds: see the takeovers among the events.", "small")];
  });
}

function roundNode(round) {
  const bids = new Map(told(round.bids, play.ms).map((b) => [b.by, b]));
  const got = new Map(told(round.got, play.ms).map((g) => [g.uav, g]));
  const made = node("div", undefined, "round");
  made.dataset.round = round.id;
  const head = node("div", undefined, "head");
  head.append(moment(round.opened_ms), node("b", "Round " + round.counter), node("span", outcomeOf(round, [...got.values()], play.ms), "small outcome"));
  const by = round.by === null ? "" : "opened by " + nameOf(round.by);
  const why = [by, whyOf(round)].filter(Boolean).join(": ");
  const table = node("table");
  const heads = table.createTHead().insertRow();
  for (const [word, title] of [["UAV", ""], ["from", "the cell of the loop before which it will be"], ["free in", "until then it flies what it has begun"],
    ["may fly", "flight time that is left after that"], ["got", "cells"], ["section", "cells of the loop in the order of flight"]]) {
    const cell = node("th", word);
    cell.title = title;
    heads.append(cell);
  }
  const body = table.createTBody();
  for (const id of round.members) {
    const row = body.insertRow(), bid = bids.get(id), has = got.get(id);
    row.dataset.uav = id;
    if (id === selected) row.className = "selected";
    const cells = bid ? [String(bid.anchor), seconds(bid.release_ms), seconds(bid.endurance_ms)] : ["–", "–", "–"];
    cells.push(has ? String(has.n_cells) : "–", has ? section(has) : "");
    const name = row.insertCell(), dot = node("i", undefined, "dot");
    dot.style.background = colourOf(id);
    name.append(dot, document.createTextNode(nameOf(id)));
    if (bid) name.title = "bid at " + clock(bid.time_ms) + (has ? ", adopted at " + clock(has.time_ms) : "");
    for (const text of cells) row.insertCell().textContent = text;
    row.lastChild.className = "section";
    row.addEventListener("click", () => select(selected === id ? 0 : id));
  }
  made.append(head, node("div", why, "small why"), table);
  return made;
}

const NEWS = {
  asked: "asked for", won: "won it", flies: "flies there", lost: "is gone", seen: "did it", left: "left it",
  "done-by": "did it", "nobody-can": "nobody can do it", over: "over",
};

function drawTasks() {
  const tasks = [...run.tasks.values()].filter((t) => t.steps.length && t.steps[0].time_ms <= play.ms)
    .filter((t) => !selected || t.steps.some((s) => s.uav === selected)).sort((a, b) => b.id - a.id).slice(0, MAX_SHOWN);
  redraw(el("task-list"), selected + " " + tasks.map((t) => t.id + ":" + told(t.steps, play.ms).length).join(), () => {
    if (tasks.length) return tasks.map(taskNode);
    return [node("p", "Nobody was asked to do anything besides the coverage by then.", "small")];
  });
}

function taskNode(task) {
  const made = node("div", undefined, "round"), list = node("ol", undefined, "steps");
  made.dataset.task = task.name;
  for (const step of told(task.steps, play.ms)) {
    const line = node("li"), who = step.uav === null ? "" : nameOf(step.uav) + " ";
    const words = [who + (NEWS[step.news] || step.news)];
    if (step.from !== null) words.push("taken over from " + nameOf(step.from));
    for (const bid of step.bids) words.push(nameOf(bid.by) + " bids " + (bid.bid_ppm / 1e4).toFixed(1) + " %");
    line.dataset.news = step.news;
    line.title = step.text;
    line.append(moment(step.time_ms), node("span", words.join(", ")));
    list.append(line);
  }
  made.append(node("b", task.name), list);
  if (task.author !== null) made.firstChild.title = "asked for by " + nameOf(task.author);
  return made;
}
