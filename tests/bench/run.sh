#!/usr/bin/env bash
# The benchmarks of physics, on one thread, in processor time:
#   tests/bench/run.sh [peers] [-o DIR] [--tets 192,1152,5184] [options of Google Benchmark]
# our methods and Bullet's deformable body on the same meshes; exit code 1 if a goal is missed. All three sizes take a quarter of an hour.
#   tests/bench/run.sh damping [-o DIR]
# explicit and implicit over damping and stiffness.
#   tests/bench/run.sh costs [-o DIR] [-r ROUNDS] [-f FIT [-k SLOWER]]
# counted work (retarget/step_cost.h) against processor time, every method on bodies of all kinds: half an hour. FIT: a file for
# the table of constants that these times ask for, of a machine that is SLOWER times as slow as this one (1).
# Installs what is missing, builds, prints a table in markdown and writes it to DIR (default: out/peers/peers.csv,
# out/damping/damping.csv, out/costs/costs.csv).
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")")
program=peer_bench
case ${1:-} in
  peers) shift ;;
  damping) program=damping_bench && shift ;;
  costs) program=step_cost_bench && shift ;;
esac
"$project/samples/setup.sh" --bench
cd -- "$project"
cmake --preset release > /dev/null
log=build/release/$program.log
cmake --build --preset release --target "$program" -j "${HYDROSTAT_BUILD_JOBS:-$(nproc)}" > "$log" || {
  cat "$log" >&2
  exit 1
}
build/release/tests/"$program" "$@"
