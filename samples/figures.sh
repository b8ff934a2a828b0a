#!/usr/bin/env bash
# Makes the pictures of README anew, in samples/figures/:  samples/figures.sh [HYDROSTAT]
# Without HYDROSTAT: build/release/hydrostat, which is built where it is not there. Times are this machine's.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")
hydrostat=${1:-$project/build/release/hydrostat}
figures=$project/samples/figures
scratch=$(mktemp -d)
trap 'rm -rf -- "$scratch"' EXIT

if [ ! -x "$hydrostat" ]; then
  cd -- "$project"
  cmake --preset release
  cmake --build --preset release --target hydrostat -j "${HYDROSTAT_BUILD_JOBS:-$(nproc)}"
fi
mkdir -p -- "$figures"
curve() {  # SCENE OPTION...
  "$hydrostat" bench accuracy "$project/samples/scenes/$1.toml" -o "$scratch/$1" --quiet "${@:2}"
  cp -- "$scratch/$1/accuracy.svg" "$figures/accuracy_$1.svg"
}
curve clamped_bar --duration 0.2 --max-error 0.05%
curve bouncing_circle
"$hydrostat" bench effects "$project/samples/scenes/swimming_eel.toml" -o "$scratch/eel"
cp -- "$scratch/eel/effects.svg" "$figures/effects_swimming_eel.svg"
echo "Pictures in $figures"
