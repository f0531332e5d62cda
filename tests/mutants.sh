#!/usr/bin/env bash
# Puts known mistakes into the code one at a time and says which the tests notice.
#
#     tests/mutants.sh                 all of tests/mutants/*.patch
#     tests/mutants.sh 03 08           those whose file names begin so
#     SEEDS=0..200 tests/mutants.sh    with so many storms where the tests notice nothing
#
# A mistake is noticed by the tests of the crate it is in, else by those of the simulator,
# else by storms. Works on a copy of the last commit; takes a minute or two a mistake.
# Exit code 1 if more than one mistake in twenty goes unnoticed.
set -uo pipefail
cd "$(dirname "$0")/.."
root=$(pwd)
seeds=${SEEDS:-0..40}
scratch=$(mktemp -d)
trap 'git worktree remove --force "$scratch/tree" 2>/dev/null; rm -rf "$scratch"' EXIT
git worktree add -q --detach "$scratch/tree" HEAD
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target/mutants}
cd "$scratch/tree"

tests_of() { cargo test -q -p "$1" --lib >"$scratch/log" 2>&1; }
storms() { cargo run -q -p skein-scenario --example storms -- helsinki "$seeds" >"$scratch/log" 2>&1; }
# The first test or rule that failed.
by() { grep -m1 -oE '^    [a-z_:]+$|^seed [0-9]+ [A-Za-z0-9-]+' "$scratch/log" | sed 's/^ *//'; }

caught=0 missed=0
for patch in "$root"/tests/mutants/*.patch; do
  name=$(basename "$patch" .patch)
  wanted=$([ $# -eq 0 ] && echo yes)
  for prefix in "$@"; do [[ $name == "$prefix"* ]] && wanted=yes; done
  [ -n "$wanted" ] || continue
  if ! patch -s -p1 <"$patch"; then
    echo "STALE   $name: it fits the code no longer" && missed=$((missed + 1))
    git checkout -q . && continue
  fi
  case $(grep -m1 '^+++ ' "$patch") in
    *behaviors/*) crates="skein-behaviors skein-netsim" ;;
    *netsim/*) crates="skein-netsim" ;;
    *) crates="skein-peer skein-netsim" ;;
  esac
  noticed=""
  for crate in $crates; do
    if ! tests_of "$crate"; then noticed="$crate: $(by)" && break; fi
  done
  if [ -z "$noticed" ] && ! storms; then noticed="storms $seeds: $(by)"; fi
  if [ -n "$noticed" ]; then
    echo "caught  $name by $noticed" && caught=$((caught + 1))
  else
    echo "MISSED  $name" && missed=$((missed + 1))
  fi
  git checkout -q .
done
echo "$caught of $((caught + missed)) mistakes are noticed"
[ $((20 * missed)) -le $((caught + missed)) ]
