#!/usr/bin/env bash
# Spoils clip files of every format and files of our own, 20,000 cases of each kind, and cuts clips off at every KiB: each must be
# read to something sane or refused with a sentence, never more (tests/fuzz/clip_fuzz.cpp). Takes hours; what was done is not done
# again by a run that follows.
#   tests/fuzz/run.sh [-n CASES] [-k "KIND ..."] [-o DIR]     DIR (out/fuzz): KIND.next, found/, summary.txt
#   tests/fuzz/run.sh -s CASES                                the first CASES of each kind, nothing kept: a test
# Exit code 1 where something was found. Clips that are not ours are looked for in HYDROSTAT_ASSETS (shared/assets beside the project).
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")")
assets=${HYDROSTAT_ASSETS:-$(realpath -m -- "$project/../shared/assets")}
program=${HYDROSTAT_FUZZ:-$project/build/release/clip_fuzz}
out=$project/out/fuzz cases=20000 kinds="cut fbx glb gltf bvh dae signals body scene manifest" slice="" largest=400k
while getopts n:k:o:s: option; do
  case $option in
    n) cases=$OPTARG ;;
    k) kinds=$OPTARG ;;
    o) out=$(realpath -m -- "$OPTARG") ;;
    s) slice=$OPTARG ;;
    *) exit 2 ;;
  esac
done
step=500
if [ -n "$slice" ]; then
  out=$(mktemp -d)
  trap 'rm -rf -- "$out"' EXIT
  cases=$slice step=$slice kinds=${kinds#cut } largest=160k
fi
[ -x "$program" ] || { echo "tests/fuzz/run.sh: $program: is not there. Build the preset release." >&2; exit 1; }
mkdir -p -- "$out"

files_of() {
  local corpus=$project/tests/fuzz/corpus
  case $1 in
    signals | body) echo "$corpus/$1.json" ;;
    manifest) echo "$corpus/manifest.toml" ;;
    scene) ls "$project"/samples/scenes/*.toml ;;
    cut) ls "$project/samples/worm_crawl.glb" "$assets"/{fbx/max_transformed_skin_zup.fbx,collada/cylinder_animated_from_3ds_max.dae} 2> /dev/null || true ;;
    *) find "$corpus" "$project/samples" "$assets" -name "*.$1" -size "-$largest" -not -path '*/broken/*' 2> /dev/null | sort || true ;;
  esac
}

failed=0
for kind in $kinds; do
  mapfile -t files < <(files_of "$kind")
  [ ${#files[@]} -gt 0 ] || continue  # of this kind there are only clips that are not ours
  next=$(cat -- "$out/$kind.next" 2> /dev/null || echo 0)
  while [ "$next" -lt "$cases" ]; do
    "$program" "$kind" "$next" "$step" "$out/found" "${files[@]}" | tee -a "$out/summary.txt" || failed=1
    next=$([ "$kind" = cut ] && echo "$cases" || echo $((next + step)))
    echo "$next" > "$out/$kind.next"
  done
done
exit "$failed"
