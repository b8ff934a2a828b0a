#!/usr/bin/env bash
# The stability suite: hard scenes by every accurate method, at two sizes, for bodies of springs, tets and hexahedra.
#   tests/stability/run.sh [-o DIR] [-j JOBS] [-t SECONDS]      all runs; hours of computing on two cores
#   tests/stability/run.sh -r [-o DIR]                          writes README's table from the runs that are there
# Writes DIR/stability.csv and DIR/scenes/, a scene file a run, for 'hydrostat simulate' (default DIR: out/stability). A run that
# is there is not run again, unless the program is another. SECONDS: what takes longer fails (1200). Exit code 1 where one failed.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")")
out=$project/out/stability jobs=$(nproc) limit=1200 only_readme=""
while getopts o:j:t:r option; do
  case $option in
    o) out=$(realpath -m -- "$OPTARG") ;;
    j) jobs=$OPTARG ;;
    t) limit=$OPTARG ;;
    r) only_readme=1 ;;
    *) exit 2 ;;
  esac
done
cd -- "$project"

if [ -z "$only_readme" ]; then
  cmake --preset release > /dev/null
  cmake --build --preset release --target stability_run -j "$jobs" | tail -n 1
  program=$project/build/release/tests/stability_run
  made_by=$(sha256sum "$program" | cut -c 1-16)
  mkdir -p -- "$out/rows" "$out/scenes"
  if [ "$(cat "$out/made_by" 2> /dev/null)" != "$made_by" ]; then
    rm -rf -- "$out/rows"
    mkdir -p -- "$out/rows"
    echo "$made_by" > "$out/made_by"
  fi
  run_case() {  # program out limit key
    local row=$2/rows/${4//[^a-zA-Z0-9]/_}
    [ ! -f "$row" ] || return 0
    timeout "$3" "$1" run "$4" "$2/scenes" > "$row.part" 2> /dev/null || echo "$4,longer than $3 s" > "$row.part"
    mv -- "$row.part" "$row"
  }
  export -f run_case
  "$program" list | xargs -d '\n' -P "$jobs" -I KEY bash -c 'run_case "$@"' _ "$program" "$out" "$limit" KEY
  {
    echo "case,name,body,method,nodes_wanted,verdict,nodes,elements,guarded,least_jacobian,volume_error,energy_excess_mgl,momentum_residual_mg,angular_loss,creep_m_s,penetration,ms_per_sim_s"
    "$program" list | while read -r key; do cat -- "$out/rows/${key//[^a-zA-Z0-9]/_}"; done
  } > "$out/stability.csv.part"
  mv -- "$out/stability.csv.part" "$out/stability.csv"
  echo "$out/stability.csv"
fi
node tests/stability/table.mjs "$out/stability.csv" ${only_readme:+README.md}
