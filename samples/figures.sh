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
for scene in clamped_bar bouncing_circle; do
  "$hydrostat" bench accuracy "$project/samples/scenes/$scene.toml" -o "$scratch/$scene" --quiet || [ $? = 3 ]
  cp -- "$scratch/$scene/accuracy.svg" "$figures/accuracy_$scene.svg"
done
"$hydrostat" bench effects "$project/samples/scenes/swimming_eel.toml" -o "$scratch/eel"
cp -- "$scratch/eel/effects.svg" "$figures/effects_swimming_eel.svg"
echo "Pictures in $figures"
