#!/usr/bin/env python3
# Coverage over time at three rates of failure: pip install mcap pandas matplotlib
#
# Usage: coverage.py [SCENARIO [RUNS [PICTURE]]]; the cells between the lines of %% also run one
# by one, in Jupyter (jupytext), VS Code or Spyder.

# %% What is flown, how often, and how many of its UAVs are lost in an hour of flight
import json, pathlib, random, sys, tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python"))
import skein

scenario, runs, picture = (sys.argv[1:] + ["helsinki", 5, "coverage.png"][len(sys.argv) - 1 :])[:3]
losses_per_uav_hour = [0, 2, 6]
place = pathlib.Path(tempfile.mkdtemp(prefix="skein-coverage-"))


# %% Faults of a run: each UAV is lost after a time drawn from an exponential distribution
def faults(uavs, rate, seed, horizon_s=3600):
    draw = random.Random(f"{rate} {seed}")
    drawn = {uav: draw.expovariate(rate / 3600) for uav in uavs} if rate else {}
    lost = [(at_s, uav) for uav, at_s in drawn.items() if at_s < horizon_s]
    # Whoever would be the last one lives.
    lost = sorted(lost)[: len(uavs) - 1]
    return {"faults": [{"at_s": round(at_s, 1), "kind": "kill", "peer": uav} for at_s, uav in lost]}


# %% Fly each rate some times, and keep the share that was seen at each half second
def fly(rate, seed):
    plan = place / f"{rate}-{seed}.json"
    plan.write_text(json.dumps(faults(uavs, rate, seed)))
    run_dir = place / f"run-{rate}-{seed}"
    report = skein.run(scenario, seed, run_dir=run_dir, flags=["--faults", str(plan)])
    frames = skein.load(run_dir).frames
    return report, frames.set_index("time_ms").covered_share


try:
    uavs = skein.run(scenario, 0)["uavs"]
    flown = {rate: [fly(rate, seed) for seed in range(int(runs))] for rate in losses_per_uav_hour}
except (skein.SkeinError, ModuleNotFoundError) as why:
    sys.exit(f"error: {why}")

# %% Numbers
import pandas

curves = {}
for rate, each in flown.items():
    table = pandas.concat([share for _, share in each], axis=1).sort_index()
    # A run that is over keeps what it has.
    curves[rate] = table.ffill()
    lost = sum(len(report["kills"]) for report, _ in each) / len(each)
    done = sorted(report["makespan_ms"] / 1000 for report, _ in each if report["makespan_ms"])
    times = f"{done[0]:.0f} to {done[-1]:.0f} s" if done else "never"
    print(f"{rate} losses per UAV and hour: {lost:.1f} UAVs lost a run, all seen in {len(done)} of {len(each)} runs, after {times}")

# %% Picture: the mean of each rate, and between which bounds its runs lie
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

figure, axes = plt.subplots(figsize=(8, 4.5))
for rate, table in curves.items():
    seconds = table.index / 1000
    (line,) = axes.plot(seconds, 100 * table.mean(axis=1), label=f"{rate} losses per UAV and hour")
    axes.fill_between(seconds, 100 * table.min(axis=1), 100 * table.max(axis=1), color=line.get_color(), alpha=0.2)
axes.set(xlabel="seconds", ylabel="share of the area seen, %", title=f"{scenario}, {runs} runs each")
axes.legend(loc="lower right")
figure.savefig(picture, dpi=150, bbox_inches="tight")
print(f"written: {picture}")
