#!/usr/bin/env bash
# Builds Hydrostat and makes a creature of a clip:  samples/run.sh [CLIP] [options of 'hydrostat convert']
# Without CLIP: samples/boxdog_trot.fbx. The creature goes to out/<name of the clip>.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")

clip=$project/samples/boxdog_trot.fbx
if [ $# -gt 0 ]; then
  clip=$(realpath -m -- "$1")
  shift
fi
name=$(basename -- "$clip")
creature=$project/out/${name%.*}

"$project/samples/setup.sh"
cd -- "$project"
cmake --preset release
cmake --build --preset release --target hydrostat -j "${HYDROSTAT_BUILD_JOBS:-$(nproc)}"

outcome=0
build/release/hydrostat convert "$clip" -o "$creature" "$@" || outcome=$?
case $outcome in
  0 | 3)
    echo "The creature: $creature"
    echo "Its page:     file://$(printf '%s' "$creature/report.html" | sed 's/%/%25/g; s/ /%20/g; s/#/%23/g; s/?/%3F/g')"
    ;;
esac
exit "$outcome"
