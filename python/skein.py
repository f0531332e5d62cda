"""Skein from Python: watch a running swarm, load a recorded run, make things go wrong, fly seeds.

One file, to be imported or copied. What each function needs is imported when it is called:
`watch` needs eclipse-zenoh and cbor2, `load` needs mcap, and pandas where tables are wanted;
`chaos` and `run` call the command `skein`. Only 127.0.0.1 is reached.

Units stand in the names; times are milliseconds of scenario time, headings degrees clockwise
from north, positions metres east and north of the mission's origin and degrees of WGS84.
"""

import dataclasses
import json
import math
import os
import pathlib
import queue
import shutil
import subprocess
import tempfile
import time


class SkeinError(Exception):
    """Something that the caller can put right; the text says how."""


# --- the running swarm -------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Trial:
    """A running trial."""

    id: str
    fleet: str
    endpoint: str  # the peer that observers attach to; empty before it is up
    run_dir: pathlib.Path
    origin: tuple  # latitude and longitude of the mission's origin, degrees; None if unknown


def trials():
    """The trials of this user that run, by their names."""
    found = []
    shared = pathlib.Path(tempfile.gettempdir()) / f"skein-{os.getuid()}"
    for path in sorted(shared.glob("*.json")):
        try:
            entry = json.loads(path.read_text())
            # An entry without a process is of a trial that is gone.
            os.kill(entry["pid"], 0)
        except (OSError, ValueError, KeyError):
            continue
        run_dir = pathlib.Path(entry["run_dir"])
        found.append(
            Trial(entry["id"], entry["fleet"], entry.get("observe") or "", run_dir, _origin(run_dir))
        )
    return found


def _origin(run_dir):
    try:
        mission = json.loads((run_dir / "mission.json").read_text())
        return mission["origin_lat_e7"] / 1e7, mission["origin_lon_e7"] / 1e7
    except (OSError, ValueError, KeyError):
        return None


def _find(trial):
    running = trials()
    if trial is not None:
        running = [t for t in running if t.id == trial]
    if not running:
        which = "no trial is running" if trial is None else f"no trial {trial} is running"
        raise SkeinError(f"{which}; start one with `skein trial`")
    if len(running) > 1:
        names = ", ".join(t.id for t in running)
        raise SkeinError(f"several trials are running, choose one by its name: {names}")
    if not running[0].endpoint:
        raise SkeinError(f"trial {running[0].id} has not launched its peers yet; try again")
    return running[0]


@dataclasses.dataclass(frozen=True)
class Record:
    """What a peer said: `body` are the places of the record in the order of docs/protocol.md."""

    key: str
    kind: str
    author: int
    life: int
    seq: int
    body: list


@dataclasses.dataclass(frozen=True)
class State(Record):
    """Where a UAV is and what it does."""

    east_m: float
    north_m: float
    lat_deg: float
    lon_deg: float
    height_m: float
    heading_deg: float
    airspeed_mps: float
    endurance_s: int
    activity: str
    covered_cells: int
    cells: int


@dataclasses.dataclass(frozen=True)
class Beacon(Record):
    """"I am here"."""

    heartbeat: int
    east_m: float
    north_m: float
    lat_deg: float
    lon_deg: float
    heading_deg: float
    finished: bool
    others: int


@dataclasses.dataclass(frozen=True)
class Claim(Record):
    """What a peer will fly: runs of cells as (first, count, backward)."""

    revision: int
    round: int
    plan: list
    held: list
    eta_ms: int


_ACTIVITIES = ["waiting", "covering", "holding", "returning", "ground station"]


def watch(endpoint=None, seconds=None, keys="**", trial=None):
    """Yields what the swarm says, each record once, for so many seconds or until it is closed.

    Without an endpoint (tcp/127.0.0.1:PORT) the only running trial is found by itself.
    """
    import cbor2
    import zenoh

    origin = None
    if endpoint is None:
        found = _find(trial)
        endpoint, origin = found.endpoint, found.origin
    else:
        origin = next((t.origin for t in trials() if t.endpoint == endpoint), None)
    config = zenoh.Config()
    for key, value in [
        ("mode", "client"),
        ("connect/endpoints", [endpoint]),
        ("scouting/multicast/enabled", False),
    ]:
        config.insert_json5(key, json.dumps(value))
    heard = queue.Queue(maxsize=10_000)
    end = None if seconds is None else time.monotonic() + seconds
    newest = {}
    try:
        session = zenoh.open(config)
    except zenoh.ZError as why:
        raise SkeinError(f"{endpoint} is not reached: {why}") from None
    with session:
        # Whoever is slower than the swarm misses records, and holds nothing up.
        def hear(sample):
            if not heard.full():
                heard.put((str(sample.key_expr), bytes(sample.payload)))

        session.declare_subscriber(keys, hear)
        while end is None or time.monotonic() < end:
            try:
                key, payload = heard.get(timeout=0.2)
            except queue.Empty:
                continue
            try:
                author, life, seq, _, _, body, *_ = cbor2.loads(payload)
                body = cbor2.loads(body)
            except (ValueError, TypeError, cbor2.CBORDecodeError):
                continue
            # Several peers may pass a record on, and an older one comes too late.
            if newest.get(key, (-1, -1)) >= (life, seq):
                continue
            newest[key] = (life, seq)
            yield _typed(key, (author, life, seq), body, origin)


def _typed(key, who, body, origin):
    parts = key.split("/")
    kind = parts[2] if len(parts) > 2 else ""
    base = (key, kind, *who, body)
    try:
        if kind == "state":
            east_m, north_m = body[0] / 1000, body[1] / 1000
            return State(
                *base, east_m, north_m, *geodetic(origin, east_m, north_m), body[2] / 1000,
                _compass(body[3]), body[4] / 1000, body[5], _ACTIVITIES[body[6]], body[8], body[9],
            )
        if kind == "beacon":
            east_m, north_m = body[1] / 1000, body[2] / 1000
            return Beacon(
                *base, body[0], east_m, north_m, *geodetic(origin, east_m, north_m),
                _compass(body[3]), body[6], len(body[15]),
            )
        if kind == "claim":
            runs = [[tuple(r[:3]) for r in listed] for listed in (body[3], body[4])]
            return Claim(*base, body[0], body[2][0], *runs, body[5])
    except (IndexError, TypeError):
        pass
    return Record(*base)


def _compass(heading_e4):
    return round((90 - math.degrees(heading_e4 / 1e4)) % 360, 2)


def geodetic(origin, east_m, north_m):
    """Latitude and longitude of a place so far from an origin, by the radii of WGS84 there: off
    by less than 0.1 m in 1 km, 10 m in 10 km. None and None without an origin."""
    if origin is None:
        return None, None
    lat, e2 = math.radians(origin[0]), 6.694379990141317e-3
    w2 = 1 - e2 * math.sin(lat) ** 2
    parallel_m = 6378137 / math.sqrt(w2)
    meridian_m = parallel_m * (1 - e2) / w2
    lat_deg = origin[0] + math.degrees(north_m / meridian_m)
    lon_deg = origin[1] + math.degrees(east_m / (parallel_m * math.cos(lat)))
    return round(lat_deg, 7), round(lon_deg, 7)


# --- recorded runs -----------------------------------------------------------------------


@dataclasses.dataclass
class Run:
    """A recorded run. Tables are pandas DataFrames, or lists of dicts where there is no pandas."""

    scenes: list  # of dicts: one, and one more for each time the mission changed
    uavs: object  # a row for each UAV and frame
    frames: object  # a row for each frame: coverage, links, components
    events: object  # a row for each event
    report: dict  # what the run came to (docs/report.md); None where it was cut off
    failure_free: dict = None  # the same run without failures, where it is known


def load(run, tables=True):
    """Loads a run from its directory or its run.mcap. A file that breaks off is loaded as far
    as it goes."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader

    path = pathlib.Path(run)
    path = path / "run.mcap" if path.is_dir() else path
    if not path.exists():
        raise SkeinError(f"{path}: no such recording; `skein sim --run-dir DIR` makes one")
    scenes, uavs, frames, events, report, failure_free = [], [], [], [], None, None
    with path.open("rb") as file:
        try:
            # In the order of the file, which is that of time: sorting reads all of it first, and
            # of a file that breaks off nothing would be left.
            messages = NonSeekingReader(file).iter_messages(log_time_order=False)
            for _, channel, message in messages:
                if not channel.topic.startswith("/skein/"):
                    continue
                value = json.loads(message.data)
                if channel.topic == "/skein/scene":
                    scenes.append(value)
                elif channel.topic == "/skein/frame":
                    frames.append(_frame(value))
                    uavs.extend(_rows(value))
                elif channel.topic == "/skein/event":
                    events.append(value)
                elif channel.topic == "/skein/failure_free":
                    failure_free = value
                elif channel.topic == "/skein/end":
                    report = value["report"]
        except McapError as why:
            if not scenes:
                raise SkeinError(f"{path}: no recording of a run: {why}") from None
    if not scenes:
        raise SkeinError(f"{path}: holds no scene of a run")
    if tables:
        uavs, frames, events = _table(uavs), _table(frames), _table(events)
    return Run(scenes, uavs, frames, events, report, failure_free)


def _frame(value):
    keep = ["time_ms", "covered_cells", "coverable_cells", "covered_share"]
    row = {key: value[key] for key in keep}
    row["links"] = len(value["links"])
    row["components"] = len(value["components"])
    return row


def _rows(frame):
    for uav in frame["uavs"]:
        row = {"time_ms": frame["time_ms"], **uav}
        row.update(row.pop("pose") or {})
        yield row


def _table(rows):
    try:
        import pandas
    except ImportError:
        return rows
    return pandas.DataFrame(rows)


# --- the command -------------------------------------------------------------------------


def command():
    """Where the command `skein` is: $SKEIN, on the path, or built beside this file."""
    root = pathlib.Path(__file__).resolve().parent.parent
    built = [str(root / "target" / kind / "skein") for kind in ("release", "debug")]
    for found in [os.environ.get("SKEIN"), shutil.which("skein"), *built]:
        if found and os.access(found, os.X_OK):
            return found
    raise SkeinError("the command `skein` is not found: cargo install --path ., or set $SKEIN")


def _call(words):
    done = subprocess.run([command(), *words], capture_output=True, text=True)
    if done.returncode > 1:
        raise SkeinError(f"skein {' '.join(words)}: {done.stderr.strip()}")
    return done


def chaos(*words, trial=None):
    """Makes something go wrong in a running trial: `chaos("kill", 3)` is `skein chaos kill 3`.
    Returns the lines that say what was done and what should follow."""
    name = [] if trial is None else ["--trial", trial]
    done = _call(["chaos", *name, *map(str, words)])
    if done.returncode:
        raise SkeinError(done.stderr.strip())
    return done.stdout.splitlines()


def run(scenario="helsinki", seeds=None, run_dir=None, flags=()):
    """Flies a scenario in virtual time: once (`seeds` is a number or nothing), or for a range of
    seeds. Returns the report of the run, or the summary of the batch, as dicts. `run_dir` keeps
    the recording of a single run, for `load`; `flags` go to `skein sim`, e.g. `["--storm"]`."""
    words = ["sim", str(scenario), "--format", "json", *flags]
    if isinstance(seeds, range):
        if seeds.step != 1 or not seeds:
            raise SkeinError("seeds: expected a range of at least one with step 1")
        words += ["--seeds", f"{seeds.start}..{seeds.stop}"]
    elif seeds is not None:
        words += ["--seed", str(seeds)]
    if run_dir is not None:
        words += ["--run-dir", str(run_dir)]
    return json.loads(_call(words).stdout)
