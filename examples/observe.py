#!/usr/bin/env python3
# What the swarm says, in Python: pip install -r requirements.txt
# Usage: observe.py [tcp/127.0.0.1:PORT [SECONDS]]; without an endpoint it finds the running trial
import pathlib, sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python"))
import skein

endpoint, seconds = (sys.argv[1:] + [None, 10][len(sys.argv) - 1:])[:2]
hidden = {"key", "kind", "author", "life", "seq", "body"}
try:
    for record in skein.watch(endpoint, float(seconds)):
        fields = {k: v for k, v in vars(record).items() if k not in hidden}
        print(record.key, f"peer {record.author} life {record.life} #{record.seq}", fields or record.body, flush=True)
except skein.SkeinError as why:
    sys.exit(f"error: {why}")
