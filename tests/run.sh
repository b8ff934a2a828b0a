#!/usr/bin/env bash
# Builds Hydrostat and passes its tests: the unit tests of physics and signals under the sanitizers (preset dev), then all tests
# on the release build. Left to the release build alone: simulations in space, which the sanitizers draw out to minutes each; the
# same sources run there in the plane; and tests of materials and element matrices (tests/CMakeLists.txt).
# Clips that are not ours are looked for in HYDROSTAT_ASSETS (default: shared/assets beside the project).
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")
[ -z "${HYDROSTAT_ASSETS:-}" ] || HYDROSTAT_ASSETS=$(realpath -m -- "$HYDROSTAT_ASSETS")
export HYDROSTAT_ASSETS=${HYDROSTAT_ASSETS:-$(realpath -m -- "$project/../shared/assets")}

"$project/samples/setup.sh" --tests
cd -- "$project"
jobs=${HYDROSTAT_BUILD_JOBS:-$(nproc)}
cmake --preset dev
cmake --build --preset dev -j "$jobs" --target physics_test signal_test
cmake --preset release
cmake --build --preset release -j "$jobs"

which=()
if [ ! -f "$HYDROSTAT_ASSETS/golden_bbox.json" ]; then
  which=(-LE third_party)
  left_out="Tests on third-party clips were left out: there are none in $HYDROSTAT_ASSETS (set HYDROSTAT_ASSETS)."
fi
[ -z "${left_out:-}" ] || echo "$left_out"
long='^ElementSteppers[.].*3d|RollsABall'
ctest --preset dev -L unit "${which[@]}" -E "$long" -j "$jobs"
ctest --preset release "${which[@]}" -j "$jobs"
