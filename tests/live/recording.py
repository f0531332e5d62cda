"""Reads recordings back with the Python packages mcap and jsonschema, as a stranger would, and with
python/skein.py. Usage: recording.py RUN_DIR; prints what it found, or fails."""

import json
import pathlib
import sys

from jsonschema import Draft202012Validator
from mcap.reader import NonSeekingReader, make_reader

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python"))
import skein

folder = pathlib.Path(sys.argv[1])
manifest = json.loads((folder / "manifest.json").read_text())
report = json.loads((folder / "report.json").read_text())
topics, validators, last = {}, {}, {}
with (folder / "run.mcap").open("rb") as file:
    summary = make_reader(file).get_summary()
    assert summary.statistics.chunk_count > 1, "chunks are flushed on the way"
    file.seek(0)
    for schema, channel, message in NonSeekingReader(file).iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        validator = validators.setdefault(schema.id, Draft202012Validator(json.loads(schema.data)))
        value = json.loads(message.data)
        validator.validate(value)
        topics[channel.topic] = topics.get(channel.topic, 0) + 1
        last[channel.topic] = value
        assert message.log_time >= 0
names = {schema.name for schema in summary.schemas.values()}
known = {"LocationFix", "GeoJSON", "Log", "FrameTransforms", "SceneUpdate"}
assert {"skein.Scene", *(f"foxglove.{name}" for name in known)} <= names, names
for uav in report["uavs"]:
    assert topics[f"/uav/{uav}/location"] > 10, topics
covered = json.loads(last["/map/cells"]["geojson"])["features"]
covered = sum(f["properties"]["cells"] for f in covered if f["properties"]["status"] == "covered")
# Cells of the loop; the judge's are finer where passes are exact.
assert covered >= min(len(last["/skein/scene"]["cells"]), report["coverage"]["covered_cells"]), covered
assert last["/skein/end"]["report"] == report
assert manifest["ended"] and manifest["recording_bytes"] == (folder / "run.mcap").stat().st_size

run = skein.load(folder, tables=False)
assert run.report == report and len(run.frames) == topics["/skein/frame"]
assert len(run.uavs) == len(run.frames) * len(report["uavs"])
assert run.frames[-1]["covered_cells"] == report["coverage"]["covered_cells"]
table = skein.load(folder)
if not isinstance(table.uavs, list):
    assert list(table.uavs.id.unique()) == report["uavs"]
# One that breaks off is read as far as it goes.
whole = (folder / "run.mcap").read_bytes()
cut = folder / "cut.mcap"
cut.write_bytes(whole[: len(whole) // 2])
part = skein.load(cut, tables=False)
assert part.report is None and 0 < len(part.frames) < len(run.frames)
assert part.frames == run.frames[: len(part.frames)]
cut.unlink()
print(f"recording: ok, {sum(topics.values())} messages on {len(topics)} channels")
