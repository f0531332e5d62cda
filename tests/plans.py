#!/usr/bin/env python3
"""Reads the .plan files that `skein plan` writes with programs of others: pymavlink, whose
commands, frames and parameters are made from MAVLink's own definitions, and MAVSDK, which
imports QGroundControl plans.

    tests/plans.py                             with target/debug/skein
    tests/plans.py --skein target/release/skein
    tests/plans.py --without-mavsdk

Makes a Python of its own below target/, with what tests/requirements-plans.txt names. It is no
part of `cargo test`. Exit code 1 if a file is not what it should be.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import own_python

ROOT = Path(__file__).resolve().parent.parent
TAKEOFFS, LANDINGS = (22, 84), (17, 20, 21, 85)
WAYPOINT, SPEED, TRIGGER = 16, 178, 206
LAND_START, LOITER_TO_ALT, LAND = 189, 31, 21
FIXED_WING = 1
RELATIVE, MISSION = 3, 2

RING = [[47.40, 8.54], [47.40, 8.55], [47.41, 8.55], [47.41, 8.54]]
FENCE = {
    "version": 2,
    "polygons": [
        {"inclusion": True, "version": 1, "polygon": [[47.39, 8.53], [47.39, 8.57], [47.42, 8.57], [47.42, 8.53]]},
        {"inclusion": False, "version": 1, "polygon": [[47.403, 8.543], [47.403, 8.544], [47.404, 8.544]]},
    ],
    "circles": [{"inclusion": False, "version": 1, "circle": {"center": [47.406, 8.546], "radius": 40}}],
    "breachReturn": [47.399, 8.545, 50],
}


LANDING = {
    "type": "ComplexItem", "complexItemType": "fwLandingPattern", "version": 2, "altitudesAreRelative": True,
    "landCoordinate": [47.3995, 8.5452, 0], "landingApproachCoordinate": [47.3955, 8.5455, 35],
    "loiterClockwise": False, "loiterRadius": 75, "stopTakingPhotos": True, "stopVideoPhotos": True,
    "useLoiterToAlt": True, "valueSetIsDistance": False,
}
# The same with its circle across the fence.
OUTSIDE = {**LANDING, "landingApproachCoordinate": [47.3902, 8.5455, 35]}


def survey(vehicle, firmware, refly=False, landing=None):
    camera = {
        "version": 2, "AdjustedFootprintSide": 60, "AdjustedFootprintFrontal": 40,
        "DistanceToSurface": 80, "DistanceMode": 1, "CameraName": "Manual (no camera specs)",
    }
    item = {
        "type": "ComplexItem", "complexItemType": "survey", "version": 5, "angle": 0, "polygon": RING,
        "TransectStyleComplexItem": {"version": 2, "TurnAroundDistance": 20, "CameraCalc": camera, "Refly90Degrees": refly},
    }
    mission = {
        "version": 2, "firmwareType": firmware, "vehicleType": vehicle, "cruiseSpeed": 15,
        "hoverSpeed": 5, "plannedHomePosition": [47.399, 8.545, 431],
        "items": [item, landing] if landing else [item],
    }
    rally = {"version": 2, "points": [[47.399, 8.539, 30]]}
    return {
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "geoFence": FENCE,
        "rallyPoints": rally, "mission": mission,
    }


def feature(kind, coordinates, **properties):
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def swapped(ring):
    return [[lon, lat] for lat, lon in ring + ring[:1]]


HOLE = [[47.402, 8.542], [47.402, 8.543], [47.403, 8.543]]
ZONE = [[47.406, 8.546], [47.406, 8.547], [47.407, 8.547]]
AREA = {
    "type": "FeatureCollection",
    "features": [
        feature("Polygon", [swapped(RING), swapped(HOLE)]),
        feature("Polygon", [swapped(ZONE)], no_fly="True"),
    ],
}
TARGETS = {
    "type": "FeatureCollection",
    "features": [
        feature("LineString", [[8.54, 47.40], [8.55, 47.40], [8.56, 47.41]]),
        feature("LineString", [[8.54, 47.415], [8.56, 47.415]], width_m=150),
        feature("MultiPoint", [[8.541, 47.401], [8.559, 47.409], [8.551, 47.412]]),
        feature("Polygon", [swapped(ZONE)], no_fly=1),
    ],
}

# Name, what is planned, its file, more flags.
CASES = [
    ("survey", "cover", survey(1, 12), []),
    ("survey of three", "cover", survey(1, 12), ["--k", "3"]),
    ("survey of ArduPilot", "cover", survey(1, 3), ["--k", "2", "--end", "loiter"]),
    ("survey of a VTOL", "cover", survey(22, 12), ["--end", "land"]),
    ("survey flown twice", "cover", survey(1, 12, refly=True), ["--k", "2"]),
    ("landing as drawn", "cover", survey(1, 12, landing=LANDING), ["--k", "2"]),
    ("landing made anew", "cover", survey(1, 3, landing=OUTSIDE), []),
    ("landing not asked for", "cover", survey(1, 12, landing=LANDING), ["--end", "rtl"]),
    ("lane cells", "cover", survey(1, 12), ["--approximate", "--turn-radius-m", "20"]),
    ("hole and zone", "cover", AREA, ["--k", "2", "--exact", "--trigger-m", "15"]),
    ("land", "cover", AREA, ["--exact", "--end", "land", "--home-altitude-m", "12.5"]),
    ("lines", "line", TARGETS, ["--k", "2"]),
    ("points", "visit", TARGETS, ["--k", "2"]),
    ("patrol", "patrol", TARGETS, ["--over", "points", "--k", "2"]),
]


class Wrong(Exception):
    pass


def need(holds, text):
    if not holds:
        raise Wrong(text)


def metres(a, b):
    north = (b[0] - a[0]) * 111_200
    east = (b[1] - a[1]) * 111_200 * math.cos(math.radians(a[0]))
    return math.hypot(north, east)


def contains(ring, point):
    inside = False
    for (lat, lon), (next_lat, next_lon) in zip(ring, ring[1:] + ring[:1]):
        if (lat > point[0]) != (next_lat > point[0]):
            at = lon + (point[0] - lat) / (next_lat - lat) * (next_lon - lon)
            inside ^= point[1] < at
    return inside


def check_items(items, dialects):
    for i, item in enumerate(items, 1):
        need(item["type"] == "SimpleItem" and item["autoContinue"] is True, f"item {i}: its kind")
        need(item["doJumpId"] == i, f"item {i}: doJumpId {item['doJumpId']}")
        command, params = item["command"], item["params"]
        need(len(params) == 7, f"item {i}: {len(params)} parameters")
        placed = item["frame"] == RELATIVE
        for dialect in dialects:
            enums = dialect.enums
            need(command in enums["MAV_CMD"], f"item {i}: command {command} is unknown")
            need(item["frame"] in enums["MAV_FRAME"], f"item {i}: frame {item['frame']} is unknown")
            entry = enums["MAV_CMD"][command]
            # What a definition leaves empty or reserves holds nothing.
            for number, value in enumerate(params, 1):
                said = entry.param.get(number, "Empty").lower()
                if said.startswith(("empty", "reserved")):
                    need(value in (0, None), f"item {i}: {entry.name} has no parameter {number}, found {value}")
            need(placed or getattr(entry, "has_location", False) is not True or command in (20, LAND_START),
                 f"item {i}: {entry.name} needs a place")
            lat, lon = (round(x * 1e7) if placed else 0 for x in params[4:6])
            nan = [float("nan") if x is None else float(x) for x in params]
            message = dialect.MAVLink_mission_item_int_message(
                1, 1, i - 1, item["frame"], command, 0, 1, *nan[:4], lat, lon, nan[6], 0)
            packed = message.pack(dialect.MAVLink(None, 255, 190))
            again = dialect.MAVLink(None).parse_buffer(bytearray(packed))
            need(again and again[0].command == command, f"item {i}: lost on its way")
        if placed:
            need(item["Altitude"] == params[6] and item["AltitudeMode"] == 1, f"item {i}: its altitudes differ")


def drawn_landing(before):
    items = before.get("mission", {}).get("items", [])
    return next((item for item in items if item["complexItemType"] == "fwLandingPattern"), None)


def descent(items):
    """Places of the circle and the glide of a fixed wing, and the course from its tangent to its end."""
    if [item["command"] for item in items[-3:]] != [LAND_START, LOITER_TO_ALT, LAND]:
        return []
    (lat, lon), radius = items[-2]["params"][4:6], items[-2]["params"][1]
    north, east = 1 / 111_200, 1 / (111_200 * math.cos(math.radians(lat)))
    land = items[-1]["params"][4:6]
    x, y = (land[1] - lon) / east, (land[0] - lat) / north
    away = math.hypot(x, y)
    need(away > abs(radius), "the circle reaches over where it lands")
    at = lambda angle: (abs(radius) * math.cos(angle), abs(radius) * math.sin(angle))
    # Clockwise it leaves its circle to the left of the line to where it lands.
    tangent = at(math.atan2(y, x) + math.copysign(math.acos(abs(radius) / away), radius))
    glide = [(tangent[0] + (x - tangent[0]) * i / 20, tangent[1] + (y - tangent[1]) * i / 20) for i in range(21)]
    circle = [at(math.radians(10 * i)) for i in range(36)]
    return [[lat + p[1] * north, lon + p[0] * east] for p in circle + glide]


def check_landing(items, before, height):
    need([item["command"] for item in items[-3:]] == [LAND_START, LOITER_TO_ALT, LAND], "lands without a pattern")
    start, loiter, land = (item["params"] for item in items[-3:])
    need(start == [0] * 7 and loiter[0] == 1 and loiter[2:4] == [0, 1] and land[:4] == [0] * 4, "not QGroundControl's pattern")
    need(loiter[6] > land[6] and loiter[6] <= height, f"comes down from {loiter[6]} m")
    drawn = drawn_landing(before)
    if drawn is LANDING:
        need(metres(loiter[4:6], drawn["landingApproachCoordinate"]) < 0.01, "another circle")
        need(metres(land[4:6], drawn["landCoordinate"]) < 0.01, "another place to land")
        need(loiter[1] == -drawn["loiterRadius"], f"circles with {loiter[1]} m")
        need((loiter[6], land[6]) == (35, 0), f"comes down from {loiter[6]} m to {land[6]} m")
    before_it = [item["params"][4:6] for item in items[:-3] if item["command"] == WAYPOINT][-1]
    off = abs(metres(before_it, loiter[4:6]) - abs(loiter[1]))
    need(off < 1, f"comes to its circle {off} m beside it")


def check_flight(plan, flight, asked, before):
    items = plan["mission"]["items"]
    commands = [item["command"] for item in items]
    need(commands[0] in TAKEOFFS and commands[1] == SPEED, f"begins with {commands[:2]}")
    need(commands[-1] in LANDINGS, f"ends with {commands[-1]}")
    end = "land" if drawn_landing(before) else "rtl"
    end = asked[asked.index("--end") + 1] if "--end" in asked else end
    need(commands[-1] in {"rtl": (20,), "loiter": (17,), "land": (21, 85)}[end], f"--end {end}: {commands[-1]}")
    height = flight["altitude_m"]
    between = commands[2:-1]
    if end == "land" and plan["mission"]["vehicleType"] == FIXED_WING:
        check_landing(items, before, height)
        between = commands[2:-3]
    need(all(c in (WAYPOINT, TRIGGER) for c in between), f"in between are {set(commands)}")
    need(0 < height <= 120, f"flies at {height} m")
    for i, item in enumerate(items, 1):
        if item["frame"] == RELATIVE and item["command"] not in (LOITER_TO_ALT, LAND, 85):
            need(item["params"][6] == height, f"item {i} is at {item['params'][6]} m, not {height} m")
    triggers = [item["params"][0] for item in items if item["command"] == TRIGGER]
    need(len(triggers) % 2 == 0, "the camera is not switched off")
    need(all(d > 0 for d in triggers[::2]) and not any(triggers[1::2]), f"triggers {triggers}")
    home = plan["mission"]["plannedHomePosition"]
    need(len(home) == 3, "home has no altitude")
    first = next(item for item in items if item["command"] == WAYPOINT)
    need(items[0]["params"][4:7] == first["params"][4:7], "does not take off towards its first waypoint")
    need(metres(home, items[0]["params"][4:6]) > 1, "takes off towards home")
    return len(triggers) // 2


def check_fence(plan, before, asked):
    fence = plan["geoFence"]
    need(fence["version"] == 2 and plan["rallyPoints"]["version"] == 2, "versions of fence and rally")
    if before.get("fileType") == "Plan":
        need(fence == before["geoFence"], "the fence is not the file's")
        need(plan["rallyPoints"] == before["rallyPoints"], "the rally points are not the file's")
        for key in ("firmwareType", "vehicleType", "hoverSpeed"):
            need(plan["mission"][key] == before["mission"][key], f"{key} is not the file's")
    else:
        rings = [p["polygon"] for p in fence["polygons"] if not p["inclusion"]]
        wanted = [ZONE, HOLE] if before is AREA else [ZONE]
        for ring in wanted:
            need(any(sorted(ring) == sorted(found) for found in rings), f"no exclusion polygon {ring}")
    for polygon in fence["polygons"]:
        need(len(polygon["polygon"]) >= 3, "a fence polygon without an area")
    items = plan["mission"]["items"]
    places = [i["params"][4:6] for i in items if i["frame"] == RELATIVE] + descent(items)
    for place in places:
        for polygon in fence["polygons"]:
            inside = contains(polygon["polygon"], place)
            need(inside == polygon["inclusion"], f"{place} on the wrong side of {polygon['polygon']}")
        for circle in fence["circles"]:
            shape = circle["circle"]
            inside = metres(shape["center"], place) < shape["radius"]
            need(inside == circle["inclusion"], f"{place} on the wrong side of a circle")


def check_with_mavsdk(files):
    """Imports each file with MAVSDK, which needs a vehicle: a heartbeat stands for it."""
    import threading

    from mavsdk import ComponentType, Configuration, Mavsdk
    from mavsdk.plugins.mission_raw import MissionRaw
    from pymavlink import mavutil

    port, over = 14_600 + os.getpid() % 400, threading.Event()

    def beat():
        link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1)
        while not over.wait(0.2):
            link.mav.heartbeat_send(1, 12, 0, 0, 3)

    ground = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with Mavsdk(ground) as mavsdk:
        mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        threading.Thread(target=beat, daemon=True).start()
        try:
            vehicle = mavsdk.first_autopilot(10.0)
            need(vehicle is not None, "MAVSDK did not see the heartbeat")
            missions = MissionRaw(vehicle)
            for path in files:
                plan = json.loads(path.read_text())
                check_import(plan, missions.import_qgroundcontrol_mission(str(path)))
        finally:
            over.set()


def check_import(plan, found):
    items = plan["mission"]["items"]
    need(len(found.mission_items) == len(items), f"MAVSDK reads {len(found.mission_items)} of {len(items)} items")
    for i, (item, read) in enumerate(zip(items, found.mission_items), 1):
        params = item["params"]
        need((read.seq, read.command, read.frame) == (i - 1, item["command"], item["frame"]), f"MAVSDK: item {i}")
        placed = item["frame"] == RELATIVE
        for value, number in zip((read.x, read.y), params[4:6]):
            need(abs(value - number * (1e7 if placed else 1)) <= 1, f"MAVSDK: item {i} is at {value}")
        need(abs(read.z - params[6]) < 1e-3, f"MAVSDK: item {i} is {read.z} m high")
        for value, number in zip((read.param1, read.param2, read.param3, read.param4), params):
            same = math.isnan(value) if number is None else abs(value - number) < 1e-3
            need(same, f"MAVSDK: item {i} has {value}, not {number}")
    fence = plan["geoFence"]
    corners = sum(len(p["polygon"]) for p in fence["polygons"]) + len(fence["circles"])
    need(len(found.geofence_items) == corners, f"MAVSDK reads {len(found.geofence_items)} of {corners} fence items")
    need(len(found.rally_items) == len(plan["rallyPoints"]["points"]), "MAVSDK: rally points")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skein", default=str(ROOT / "target" / "debug" / "skein"))
    parser.add_argument("--without-mavsdk", action="store_true")
    args = parser.parse_args()
    from pymavlink.dialects.v20 import ardupilotmega, common

    failed, all_files = 0, []
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, kind, before, flags) in enumerate(CASES):
            file = Path(folder) / f"{number}.{'plan' if 'fileType' in before else 'geojson'}"
            file.write_text(json.dumps(before))
            out = Path(folder) / f"{number}"
            base = [args.skein, "plan", kind, str(file), "--steps", "500", *flags]
            try:
                told = json.loads(subprocess.run(base, check=True, capture_output=True, text=True).stdout)
                written = subprocess.run([*base, "--format", "plan", "--out", str(out)], check=True, capture_output=True, text=True)
                files = [Path(f) for f in json.loads(written.stdout)["files"]]
                flying = [f for f in told["flights"] if len(f["points"]) > 1]
                need(len(files) == len(flying), f"{len(files)} files for {len(flying)} UAVs that fly")
                items = seen = 0
                for flight, path in zip(flying, files):
                    plan = json.loads(path.read_text())
                    need((plan["fileType"], plan["version"], plan["mission"]["version"]) == ("Plan", 1, 2), "versions")
                    check_items(plan["mission"]["items"], [common, ardupilotmega])
                    seen += check_flight(plan, flight, flags, before)
                    check_fence(plan, before, flags)
                    items += len(plan["mission"]["items"])
                    all_files.append(path)
                print(f"ok     {name}: {len(files)} files, {items} items, the camera works {seen} times")
            except subprocess.CalledProcessError as error:
                failed += 1
                print(f"WRONG  {name}: {error.stderr.strip()}")
            except Wrong as error:
                failed += 1
                print(f"WRONG  {name}: {error}")
        if not args.without_mavsdk:
            try:
                check_with_mavsdk(all_files)
                print(f"ok     MAVSDK imports all {len(all_files)} files, item by item")
            except Wrong as error:
                failed += 1
                print(f"WRONG  {error}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    own_python.go_on_in("plans-python", "requirements-plans.txt")
    main()
