#!/usr/bin/env python3
"""Opens the page of a simulated run in a browser without a window, takes it through a kill, and
reads the takeover off it: roster, events, and where nobody is asked to allow it, no console
error. Then takes pictures of 8 and of 100 UAVs at the width of a desk and of a phone.

    tests/page.py                              with target/debug/skein
    tests/page.py --skein target/release/skein --pictures DIR
    tests/page.py --few                        8 UAVs only: 100 take some minutes in a debug build

Makes a Python of its own below target/, with what tests/requirements-page.txt names; the browser
is the system's: `apt-get install chromium`, or CHROMIUM=/path/to/it. It is no part of
`cargo test`. Exit code 1 if the page does not show what it should, 2 without a browser.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import own_python

ROOT = Path(__file__).resolve().parent.parent
SIZES = ((1280, 800), (390, 844))


def browser_program():
    named = os.environ.get("CHROMIUM")
    found = named or next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
    if not found:
        print("no browser: apt-get install chromium, or CHROMIUM=/path/to/it", file=sys.stderr)
        sys.exit(2)
    return found


class Run:
    """A run of `skein`, and the page that it says it serves."""

    def __init__(self, skein, args):
        self.process = subprocess.Popen([skein, *args], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            found = re.search(r"page: (http://\S+)", line)
            if found:
                self.url = found[1]
                return
        sys.exit(f"skein {' '.join(args)} served no page")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(timeout=60)


def check(holds, text):
    print(("ok    " if holds else "WRONG ") + text)
    if not holds:
        check.failed = True


check.failed = False


def opened(browser, url, size, at_s=None, **wishes):
    """A page at one moment of its run, and what its console said."""
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, reduced_motion="reduce")
    page = context.new_page()
    said = []
    page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    if at_s is not None:
        wishes["t"] = at_s
    query = "&".join(f"{name}={value}" for name, value in wishes.items())
    base, _, token = url.partition("#")
    page.goto(f"{base}?{query}" + (f"#{token}" if token else ""))
    if at_s is not None:
        clock = f"{int(at_s) // 60}:{int(at_s) % 60:02}"
        page.locator("#fact-time", has_text=re.compile(f"^{clock}$")).wait_for(timeout=400_000)
    return page, said


def takeovers(page):
    """Who took how many cells of whom, as the roster says."""
    rows = page.locator("#rows tr").all()
    told = {}
    for row in rows:
        for n, of in re.findall(r"(\d+) of (\S+?)(?:,|$)", row.locator("td.took").inner_text()):
            told[row.locator("td").first.inner_text().strip(), of] = int(n)
    return told


def through_a_kill(skein, browser):
    """The run of which the page must say what the report says."""
    report = subprocess.run([skein, "sim", "helsinki", "--format", "json"], capture_output=True, text=True, check=False)
    report = json.loads(report.stdout)
    kill = next(k for k in report["kills"] if k["taken_over_by"] and k["peer"] != 4)
    dead, at_s = kill["peer"], kill["at_ms"] / 1000
    after_s = max(t["first_ms"] for t in kill["taken_over_by"]) / 1000
    with Run(skein, ["sim", "helsinki", "--web"]) as run:
        page, said = opened(browser, run.url, SIZES[0], at_s - 2)
        row = page.locator(f'[data-uav="{dead}"]')
        check("dead" not in (row.get_attribute("class") or ""), f"uav{dead} lives two seconds before its end")
        before = takeovers(page)
        # Step by step through the kill, as a person does with the key.
        for _ in range(3 + int(after_s / 5) + 1):
            page.keyboard.press(".")
        page.wait_for_timeout(600)
        check("dead" in row.get_attribute("class"), f"uav{dead} is lost after it")
        told = {of: n for of, n in takeovers(page).items() if before.get(of) != n}
        wanted = {(f"uav{t['peer']}", f"uav{dead}"): t["cells"] for t in kill["taken_over_by"]}
        check(all(told.get(of) == n for of, n in wanted.items()), f"the roster tells the takeovers of the report: {wanted}")
        page.keyboard.press("2")
        page.wait_for_timeout(300)
        events = page.locator('#event-list li[data-kind="takeover"]', has_text=f"of uav{dead}").count()
        check(events >= len(wanted), f"the events tell {events} takeovers of uav{dead}")
        page.keyboard.press("3")
        page.wait_for_timeout(300)
        rounds(page, at_s, dead)
        note = page.locator("#curve-note").inner_text()
        check(re.search(r"without failures \d+\.\d % by then, done at \d+:\d\d", note), f"the curve without failures is told: {note!r}")
        reference(page, report)
        check(not said, f"the console is quiet: {said}")
        page.context.close()
        strangers(run.url.partition("#")[0])


def rounds(page, at_s, dead):
    """The rounds up to a moment after the kill, and that those that came later are gone before it."""
    told = page.locator("#round-list .round").all()
    texts = [one.inner_text() for one in told]
    check(bool(told), f"{len(told)} rounds are told")
    check(any(re.search(r"opened by uav\d+: (cells that nobody lists|to even out the work)", text) for text in texts), "who opened a round and why is told")
    rows = page.locator("#round-list .round tbody tr").all_inner_texts()
    full = [row for row in rows if re.match(r"uav\d+\t\d+\t\d+ s\t\d+ s\t\d+\t\S", row)]
    check(bool(full), f"{len(full)} of {len(rows)} members have a bid and got a section: {full[:1]}")
    adopted = [one for one in told if "all adopted it" in one.inner_text() and at_s < moment(one)]
    members = [[row.get_attribute("data-uav") for row in one.locator("tbody tr").all()] for one in adopted]
    check(bool(members) and all(str(dead) not in of for of in members), f"a round after the kill was adopted without uav{dead}")
    page.evaluate(f"seek({int(at_s * 1000) - 1000})")
    page.wait_for_timeout(400)
    before = [moment(one) for one in page.locator("#round-list .round").all()]
    check(all(t <= at_s for t in before) and len(before) < len(told), f"a second before it {len(before)} rounds are told, none of them later")
    page.evaluate("seek(run.lastMs)")
    page.wait_for_timeout(400)


def moment(one):
    """When a round was opened, seconds."""
    minutes, seconds = one.locator(".moment").first.inner_text().split(":")
    return int(minutes) * 60 + int(seconds)


def reference(page, report):
    """The curve without failures rises to all, and sooner than the run did."""
    points = page.evaluate("run.failureFree.coverage")
    check(points[0] == [0, 0] and points[-1][1] == 1, f"the curve without failures has {len(points)} points, the last at 100 %")
    check(all(a[0] < b[0] and a[1] <= b[1] for a, b in zip(points, points[1:])), "and never falls")
    made = page.evaluate("run.failureFree.makespan_ms")
    check(made < report["makespan_ms"], f"without failures it is done sooner: {made} of {report['makespan_ms']} ms")


def strangers(url):
    """Requests of others are refused."""
    for name, request in (
        ("of another origin", urllib.request.Request(url + "fault", b"{}", {"origin": "http://evil.example"})),
        ("without a token", urllib.request.Request(url + "fault", b"{}", {"origin": url.rstrip("/")})),
        ("by another host's name", urllib.request.Request(url, None, {"host": "evil.example"})),
    ):
        try:
            urllib.request.urlopen(request, timeout=10)
            check(False, f"a request {name} is refused")
        except urllib.error.HTTPError as refused:
            check(refused.code in (403, 421), f"a request {name} is refused ({refused.code})")


def recorded(skein, folder, scenario):
    """The directory of a recorded run."""
    run_dir = folder / scenario
    subprocess.run([skein, "sim", scenario, "--run-dir", str(run_dir), "--format", "json"], stdout=subprocess.DEVNULL, check=False)
    return run_dir


def response(page, name):
    """How long it takes from a jump in time to the moment drawn, panels and charts too."""
    took = page.evaluate("""() => {
        const took = [];
        for (let i = 1; i <= 20; i += 1) {
            const at = performance.now();
            seek(run.lastMs * ((i * 7) % 20) / 20);
            panelsAt = 0;
            draw(performance.now());
            took.push(performance.now() - at);
        }
        return took.sort((a, b) => a - b);
    }""")
    check(took[10] < 250 and took[-1] < 1500, f"{name}: a jump in time is drawn within {took[10]:.0f} ms at the median, {took[-1]:.0f} ms at most")


def pictures(skein, browser, folder, scenario, at_s):
    with Run(skein, ["replay", str(recorded(skein, folder, scenario)), "--web"]) as run:
        for size in SIZES:
            for tab in ("rounds", "tasks", "events"):
                page, said = opened(browser, run.url, size, at_s, theme="light", tab=tab)
                page.wait_for_timeout(1000)
                file = folder / f"{scenario}-{size[0]}-{tab}.png"
                page.screenshot(path=str(file), full_page=True)
                wide = page.locator("html").evaluate("node => node.scrollWidth")
                check(wide <= size[0], f"{file.name}: nothing is wider than the window ({wide} px)")
                inner = page.locator(f"#{tab}").evaluate("node => node.scrollWidth - node.clientWidth")
                check(inner <= 0, f"{file.name}: the tab need not be moved sideways ({inner} px)")
                if tab == "rounds":
                    response(page, file.name)
                check(not said, f"{file.name}: the console is quiet: {said}")
                page.context.close()
            for theme in ("light", "dark"):
                page, said = opened(browser, run.url, size, at_s, theme=theme)
                page.wait_for_timeout(1000)
                file = folder / f"{scenario}-{size[0]}-{theme}.png"
                page.screenshot(path=str(file))
                wide = page.locator("html").evaluate("node => node.scrollWidth")
                check(wide <= size[0], f"{file.name}: nothing is wider than the window ({wide} px)")
                check(not said, f"{file.name}: the console is quiet: {said}")
                page.context.close()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--skein", default=str(ROOT / "target" / "debug" / "skein"))
    parser.add_argument("--pictures", default=str(ROOT / "target" / "pictures"))
    parser.add_argument("--few", action="store_true")
    args = parser.parse_args()
    own_python.go_on_in("page-python", "requirements-page.txt")
    from playwright.sync_api import sync_playwright

    folder = Path(args.pictures)
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        # Chromium's own sandbox refuses to be started by root, as on a build machine.
        browser = playwright.chromium.launch(executable_path=browser_program(), args=["--no-sandbox"])
        through_a_kill(args.skein, browser)
        pictures(args.skein, browser, folder, "helsinki", 98)
        if not args.few:
            pictures(args.skein, browser, folder, "swarm_100", 170)
        browser.close()
    print(f"pictures in {folder}")
    sys.exit(1 if check.failed else 0)


if __name__ == "__main__":
    main()
