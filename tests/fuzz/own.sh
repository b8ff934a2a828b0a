#!/usr/bin/env bash
# The parsers of our own files under libFuzzer with address and undefined-behaviour sanitizers: what they hold, they are read or
# refused with an Error. Wants clang 14 or later (apt install clang) and the release build, whose libraries the parsers call.
#   tests/fuzz/own.sh [-t SECONDS] [-k "KIND ..."]     SECONDS of each kind (300) of: signals body manifest world
# Inputs that were found to reach something new are kept in out/fuzz/own/ and taken up by the next run.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")")
build=$project/build/release out=$project/out/fuzz/own seconds=300 kinds="signals body manifest world"
while getopts t:k: option; do
  case $option in
    t) seconds=$OPTARG ;;
    k) kinds=$OPTARG ;;
    *) exit 2 ;;
  esac
done
clang=$(command -v clang++-14 || command -v clang++) || { echo "tests/fuzz/own.sh: clang++: is not here. Install it: apt install clang." >&2; exit 1; }
cmake --build "$build" --target hydrostat > /dev/null
mkdir -p -- "$out/objects"

flags=(-std=c++20 -O1 -g -DNDEBUG -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=null,alignment
  -fno-sanitize-recover=undefined -I"$project" -isystem /usr/include/eigen3 -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1)
objects=()
for source in tests/fuzz/own_files_fuzz io/{signals_file,body_file,batch_manifest,scene_file,scene_shapes,scene_body,toml_reader,write_file}; do
  object=$out/objects/${source##*/}.o
  objects+=("$object")
  changed=$([ -e "$object" ] && find "$project/$source.cpp" "$project"/{io,physics,retarget,signal}/*.h -newer "$object" || echo all)
  [ -z "$changed" ] || "$clang" "${flags[@]}" -c "$project/$source.cpp" -o "$object"
done
# The rest as hydrostat links it.
mapfile -t libraries < <(ninja -C "$build" -t commands hydrostat | tail -n 1 | tr ' ' '\n' | grep -E '^-l|\.so|\.a$' | grep -v '^cli/')
(cd -- "$build" && "$clang" -fsanitize=fuzzer,address,undefined -o "$out/own_files_fuzz" "${objects[@]}" "${libraries[@]}")

cd -- "$out"
for kind in $kinds; do
  mkdir -p -- "$kind"
  case $kind in
    world) cp -n -- "$project"/samples/scenes/*.toml world/ ;;
    *) cp -n -- "$project/tests/fuzz/corpus/$kind".* "$kind/" ;;
  esac
  HYDROSTAT_FUZZ_KIND=$kind ./own_files_fuzz -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -max_len=100000 -verbosity=0 \
    -print_final_stats=1 -artifact_prefix="found_${kind}_" "$kind" 2>&1 | grep -E "ERROR|SUMMARY|number_of_executed_units|Test unit" || true
  ! ls "found_${kind}_"* > /dev/null 2>&1 || { echo "$kind: $(ls "found_${kind}_"* | wc -l) found in $out"; failed=1; }
done
exit "${failed:-0}"
