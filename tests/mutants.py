#!/usr/bin/env python3
"""Puts mistakes into the code and says which are noticed: by the tests of the crate, else by
those of the simulator and the kept seeds, else by storms.

    tests/mutants.py                        all of tests/mutants/*.patch
    tests/mutants.py 03 08                  those whose file names begin so
    tests/mutants.py --sample 100 --seed 7  of those that cargo mutants makes in runtime/peer
    tests/mutants.py --sample 100 --seed 7 --storms 200 --kept

Needs python3, and for samples `cargo install cargo-mutants`. Works on a copy of the last commit.

One build holds all mistakes: the body of a function becomes a choice between the body as it is
and the body with each of its mistakes, and the environment variable MUTANT chooses at run time.
What cannot be built so (constants, `const fn`, results of type `impl`) is built by itself; what
cannot be built at all is not counted.

Storms notice a mistake if so many runs fail that chance would do so once in a thousand times, at
the rate at which runs of the code as it is fail, or if a batch does not end.

Exit code 1 if of the listed mistakes more than one in twenty go unnoticed, of a sample one in ten.
"""

import argparse
import json
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NOT_SAMPLED = ["runtime/peer/src/testing.rs", "**/schema.rs"]
CHOICE = """
/// Which mistake is in force.
pub(crate) fn mutant() -> u32 {
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("MUTANT").ok().and_then(|n| n.parse().ok()).unwrap_or(0))
}
"""
LITERAL = re.compile(
    r"""//[^\n]*|/\*.*?\*/|b?r(?P<h>\#*)".*?"(?P=h)|b?"(?:\\.|[^"\\])*"|b?'(?:\\.[^']*|[^'\\])'""", re.S
)
OPENS, CLOSES = "([{", ")]}"


def bodies(text):
    """Of each function in order where it begins, and where its body begins and ends."""
    code = LITERAL.sub(lambda m: " " * len(m.group()), text)
    found = []
    for name in re.finditer(r"\bfn\s+\w+", code):
        at, depth = name.end(), 0
        while depth > 0 or code[at] not in "{;":
            depth += (code[at] in OPENS) - (code[at] in CLOSES)
            at += 1
        if code[at] == ";":
            continue
        begin, depth = at + 1, 1
        while depth > 0:
            at += 1
            depth += (code[at] in OPENS) - (code[at] in CLOSES)
        found.append((name.start(), begin, at))
    return found


def crate_of(tree, file):
    return next(p for p in (tree / file).parents if (p / "Cargo.toml").exists())


def span_of(text, span):
    lines = text.splitlines(keepends=True)
    place = lambda p: sum(map(len, lines[: p["line"] - 1])) + p["column"] - 1
    return place(span["start"]), place(span["end"])


class Mistake:
    """The files that differ, with their texts."""

    def __init__(self, name, files):
        self.name, self.files = name, files


def listed(tree, prefixes):
    """The mistakes of tests/mutants; one that fits the code no longer has no files."""
    for patch in sorted((ROOT / "tests/mutants").glob("*.patch")):
        if prefixes and not any(patch.name.startswith(p) for p in prefixes):
            continue
        files = re.findall(r"^\+\+\+ b/(\S+)", patch.read_text(), re.M)
        before = {file: (tree / file).read_text() for file in files}
        fits = subprocess.run(["patch", "-s", "-p1", "--no-backup-if-mismatch", "-r", "/dev/null", "-i", patch], cwd=tree).returncode == 0
        after = {file: (tree / file).read_text() for file in files} if fits else {}
        subprocess.run(["git", "checkout", "-q", "."], cwd=tree, check=True)
        assert {file: (tree / file).read_text() for file in files} == before
        yield Mistake(patch.stem, after)


def sampled(tree, size, seed, only):
    command = ["cargo", "mutants", "--list", "--json", "-p", "skein-peer"]
    for glob in NOT_SAMPLED:
        command += ["-e", glob]
    out = subprocess.run(command, cwd=tree, check=True, capture_output=True, text=True).stdout
    made = sorted(json.loads(out), key=lambda m: m["name"])
    made = [m for m in made if re.search(only, m["name"])]
    print(f"{min(size, len(made))} of {len(made)} mistakes, seed {seed}", flush=True)
    drawn = random.Random(seed).sample(made, min(size, len(made)))
    for m in sorted(drawn, key=lambda m: m["name"]):
        text = (tree / m["file"]).read_text()
        begin, end = span_of(text, m["span"])
        yield Mistake(m["name"], {m["file"]: text[:begin] + m["replacement"] + text[end:]})


class Build:
    """A tree with mistakes in it, and the programs made from it."""

    def __init__(self, tree, mistakes):
        self.tree, self.mistakes = tree, mistakes
        files = {file for m in mistakes.values() for file in m.files}
        files |= {str((crate_of(tree, f) / "src/lib.rs").relative_to(tree)) for f in files}
        self.texts = {file: (tree / file).read_text() for file in sorted(files)}

    def write(self, texts):
        for file, text in {**self.texts, **texts}.items():
            if file.endswith("src/lib.rs"):
                # After the crate's documentation, which is made of inner comments.
                at = max(m.end() for m in re.finditer(r"^//!.*\n", text, re.M))
                text = text[:at] + "#![allow(warnings)]\n" + text[at:] + CHOICE
            (self.tree / file).write_text(text)

    def arms(self, file, after):
        """The bodies in which two texts of a file differ; none if they differ elsewhere."""
        before = self.texts[file]
        old, new = bodies(before), bodies(after)
        if len(old) != len(new):
            return None
        differ, outside, at = [], [], (0, 0)
        for (head, a, b), (_, c, d) in zip(old, new):
            if a < at[0] or before[a:b] == after[c:d]:
                continue
            line = before.rfind("\n", 0, head) + 1
            signature = before[line:a]
            if "-> impl" in signature or "const fn" in signature:
                return None
            differ.append((a, b, after[c:d]))
            outside.append((before[at[0] : a], after[at[1] : c]))
            at = (b, d)
        outside.append((before[at[0] :], after[at[1] :]))
        return differ if all(x == y for x, y in outside) else None

    def put_all(self, numbers):
        """All of them behind one choice. Returns those that have no place in one, and the
        lines of the others by file."""
        apart, by_body = set(), {}
        for number in numbers:
            arms = {f: self.arms(f, text) for f, text in self.mistakes[number].files.items()}
            if any(a is None for a in arms.values()):
                apart.add(number)
                continue
            for file, differ in arms.items():
                for begin, end, body in differ:
                    by_body.setdefault(file, {}).setdefault((begin, end), []).append((number, body))
        texts, lines = {}, {}
        for file, of_file in by_body.items():
            before, out, at = self.texts[file], "", 0
            for (begin, end), arms in sorted(of_file.items()):
                if begin < at:  # a function inside a function
                    apart |= {number for number, _ in arms}
                    continue
                out += before[at:begin] + "\nmatch crate::mutant() {\n"
                for number, body in arms:
                    first = out.count("\n")
                    out += f"{number} => {{{body}\n}}\n"
                    lines.setdefault(file, []).append((first, out.count("\n") + 1, number))
                out += "_ => {" + before[begin:end] + "\n}\n}\n"
                at = end
            texts[file] = out + before[at:]
        self.write(texts)
        return apart, lines

    def put_one(self, number):
        self.write(self.mistakes[number].files)

    def cargo(self, *command):
        """Whether it went well, the errors, and the programs by their name."""
        ran = subprocess.run(
            ["cargo", *command, "--message-format=json"],
            cwd=self.tree, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        errors, programs = [], {}
        for said in map(json.loads, ran.stdout.splitlines()):
            if said.get("reason") == "compiler-message" and said["message"]["level"] == "error":
                errors.append(said["message"])
            if said.get("reason") == "compiler-artifact" and said.get("executable"):
                programs[said["target"]["name"]] = said["executable"]
        return ran.returncode == 0, errors, programs


def run(command, number, cwd, most_s):
    """What it said, and what was wrong; None if it went well."""
    env = dict(os.environ, MUTANT=str(number), PROPTEST_RNG_SEED="27", CARGO_MANIFEST_DIR=str(cwd),
               PROPTEST_DISABLE_FAILURE_PERSISTENCE="1", RUST_BACKTRACE="0")
    try:
        ran = subprocess.run(command, cwd=cwd, env=env, timeout=most_s, text=True, errors="replace",
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    except subprocess.TimeoutExpired:
        return "", "it does not end"
    if ran.returncode == 0:
        return ran.stdout, None
    failed = re.search(r"^    (\w+(?:::\w+)+)$", ran.stdout, re.M)
    return ran.stdout, failed.group(1) if failed else f"exit code {ran.returncode}"


class Storms:
    """Batches of random faults, compared with those of the code as it is."""

    SLICE = 40

    def __init__(self, upto, tree):
        self.upto, self.tree, self.rate, self.histories = upto, tree, None, {}

    def batch(self, program, number, begin):
        said, wrong = run([program, "helsinki", f"{begin}..{begin + self.SLICE}"], number, self.tree, 1200)
        seeds = re.search(r"^failed seeds \[(.*)\]", said, re.M)
        if not seeds:
            return self.SLICE, wrong, ""
        rule = re.search(r"^seed \d+ (\S+)", said, re.M)
        history = re.search(r"^history (\S+)", said, re.M)
        return len(re.findall(r"\d+", seeds.group(1))), rule and rule.group(1), history.group(1)

    def base(self, program):
        failed = 0
        for begin in range(0, self.upto, self.SLICE):
            n, _, self.histories[begin] = self.batch(program, 0, begin)
            failed += n
        self.rate = (failed + 1) / self.upto
        print(f"of storms 0..{self.upto} of the code as it is {failed} fail", flush=True)

    def noticed(self, program, number):
        failed, same = 0, True
        for begin in range(0, self.upto, self.SLICE):
            n, rule, history = self.batch(program, number, begin)
            failed += n
            same &= history == self.histories[begin]
            mean = self.rate * (begin + self.SLICE)
            chance = 1 - sum(math.exp(-mean) * mean**i / math.factorial(i) for i in range(failed))
            if chance < 0.001:
                return f"storms 0..{begin + self.SLICE}: {failed} fail, {rule}"
        if same:
            print(f"        no history of storms 0..{self.upto} changes with {number}", flush=True)
        return None


class Trial:
    """Runs the tests on one mistake after the other."""

    def __init__(self, build, asked):
        self.build, self.asked = build, asked
        self.storms = Storms(asked.storms, build.tree)

    def wanted(self, numbers):
        """Packages with unit tests to run, those of the mistakes first."""
        files = [f for n in numbers for f in self.build.mistakes[n].files]
        crates = {str(crate_of(self.build.tree, f).relative_to(self.build.tree)) for f in files}
        names = {"runtime/peer": "skein-peer", "behaviors": "skein-behaviors", "netsim/sim": "skein-netsim"}
        if not self.asked.crate_only:
            crates.add("netsim/sim")
        return {names[c]: c for c in sorted(crates, key=lambda c: (c == "netsim/sim", c))}

    def programs(self, numbers):
        made, steps = {}, [("test", "--no-run", "--lib", "-p", p) for p in self.wanted(numbers)]
        if self.asked.kept:
            steps.append(("test", "--no-run", "--test", "swarm", "-p", "skein-tests"))
        if self.asked.storms:
            steps.append(("build", "-p", "skein-scenario", "--example", "storms"))
        for step in steps:
            well, errors, one = self.build.cargo(*step)
            if not well:
                return None, errors
            made.update(one)
        return made, []

    def tests(self, number, made):
        tree, mistake = self.build.tree, self.build.mistakes.get(number)
        for package, folder in self.wanted([number] if mistake else self.build.mistakes).items():
            program = made[package.replace("-", "_")]
            # The tests of the module itself are the likeliest to notice, and the quickest.
            file = next((f for f in mistake.files if f.startswith(folder)), None) if mistake else None
            if file:
                module = Path(file).relative_to(f"{folder}/src").with_suffix("")
                module = "::".join(p for p in module.parts if p not in ("lib", "mod"))
                wrong = run([program, module + "::"], number, tree / folder, 60)[1]
                if wrong:
                    return wrong
            wrong = run([program], number, tree / folder, 1200)[1]
            if wrong:
                return wrong
        if self.asked.kept:
            return run([made["swarm"], "seeds::"], number, tree / "tests", 1800)[1]
        return None

    def noticed(self, number, made):
        by = self.tests(number, made)
        if by is None and self.asked.storms:
            if self.storms.rate is None:
                self.storms.base(made["storms"])
            by = self.storms.noticed(made["storms"], number)
        return by

    def outcomes(self):
        """Each mistake, with what noticed it; none, `unviable`, `stale`."""
        build, apart = self.build, set()
        for number, m in build.mistakes.items():
            if not m.files:
                yield number, "stale"
        numbers = {n for n, m in build.mistakes.items() if m.files}
        while True:
            without, lines = build.put_all(sorted(numbers - apart))
            apart |= without
            # Some errors come late, as of sums that are known to overflow.
            well, errors, _ = build.cargo("check", "-p", "skein-peer", "-p", "skein-netsim", "--lib")
            made = None
            if well:
                made, errors = self.programs(numbers)
            if made is not None:
                break
            blamed = {
                number
                for e in errors
                for s in e["spans"]
                for first, last, number in lines.get(s["file_name"], [])
                if first <= s["line_start"] <= last
            }
            if not blamed - apart:
                sys.exit("".join(e["rendered"] for e in errors[:3]))
            apart |= blamed
        if wrong := self.tests(0, made):
            sys.exit(f"without a mistake: {wrong}")
        for number in sorted(numbers - apart):
            yield number, self.noticed(number, made)
        for number in sorted(apart):
            build.put_one(number)
            made = self.programs([number])[0]
            yield number, "unviable" if made is None else self.noticed(number, made)


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("prefix", nargs="*", help="of listed mistakes those that begin so")
    ask.add_argument("--sample", type=int, help="so many of those that cargo mutants makes, instead")
    ask.add_argument("--seed", type=int, default=1)
    ask.add_argument("--only", default="", help="of those the ones whose names match this")
    ask.add_argument("--storms", type=int, default=0, help="how many, a multiple of 40")
    ask.add_argument("--kept", action="store_true", help="also the kept seeds")
    ask.add_argument("--crate-only", action="store_true", help="by the tests of the crate alone")
    ask.add_argument("--tree", type=Path, help="a clean copy to work in")
    asked = ask.parse_args()

    scratch = Path(tempfile.mkdtemp())
    tree = asked.tree or scratch / "tree"
    if not asked.tree:
        subprocess.run(["git", "worktree", "add", "-q", "--detach", tree, "HEAD"], cwd=ROOT, check=True)
    os.environ.setdefault("CARGO_TARGET_DIR", str(ROOT / "target/mutants"))
    try:
        drawn = asked.sample is not None
        mistakes = sampled(tree, asked.sample, asked.seed, asked.only) if drawn else listed(tree, asked.prefix)
        mistakes = dict(enumerate(mistakes, start=1))
        count = {"MISSED": 0, "STALE": 0, "unviable": 0, "caught": 0}
        for number, by in Trial(Build(tree, mistakes), asked).outcomes():
            word = {None: "MISSED", "stale": "STALE", "unviable": "unviable"}.get(by, "caught")
            count[word] += 1
            print(f"{word:8}{mistakes[number].name}" + (f" by {by}" if word == "caught" else ""), flush=True)
    finally:
        subprocess.run(["git", "checkout", "-q", "."], cwd=tree)
        if not asked.tree:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT)
        shutil.rmtree(scratch, ignore_errors=True)
    missed = count["MISSED"] + count["STALE"]
    viable = missed + count["caught"]
    print(f"{count['caught']} of {viable} mistakes are noticed; {count['unviable']} do not compile")
    return missed * (10 if drawn else 20) > viable


if __name__ == "__main__":
    sys.exit(main())
