#!/usr/bin/env python3
# What the swarm publishes, in Python: pip install -r requirements.txt
# Usage: observe.py tcp/127.0.0.1:PORT [SECONDS [KEYS]]
import json, sys, time
import cbor2, zenoh

endpoint, seconds, keys = (sys.argv[1:] + ["10", "**"][len(sys.argv) - 2:])[:3]
config = zenoh.Config()
for key, value in [("mode", "client"), ("connect/endpoints", [endpoint]), ("scouting/multicast/enabled", False)]:
    config.insert_json5(key, json.dumps(value))
shown = set()

def show(sample):
    author, life, seq, kind, subject, body, *_ = cbor2.loads(bytes(sample.payload))
    version = (str(sample.key_expr), life, seq)
    if version not in shown:  # several peers may have passed it on
        shown.add(version)
        print(sample.key_expr, f"peer {author} life {life} #{seq}", cbor2.loads(body), flush=True)

with zenoh.open(config) as session:
    subscriber = session.declare_subscriber(keys, show)
    time.sleep(float(seconds))
