#!/usr/bin/env bash
# The balance bench: how long creatures keep their feet, over clips, seeds, pushes and variants of the corrector.
#   tests/balance/run.sh [-o DIR] [-c "CLIP ..."] [-v "VARIANT ..."] [-s SEEDS] [-n CYCLES] [-p SPEED] [-w SCENE] [-m "NODES ..."] [-j JOBS] [-r]
# Writes DIR/balance.csv and DIR/balance.html (default DIR: out/balance). A run that is there is not run again; one that was
# broken off goes on where it was. -p SPEED adds, for the plan's body, pushes of so many m/s in 8 directions at 4 phases. -w SCENE lets all go in a
# creature's scene (README, "A creature's scene"). A variant that begins with "polished" goes by polished signals (README, "Polish");
# "polished:delay=0.02" likewise. -m NODES makes of each clip a creature on so many nodes, CLIP@NODES, instead of the usual mesh. -r writes
# README's table (with -m that of the meshes). Fails where a run has a hidden hand: an assist, or momentum that gravity,
# contact and effects do not explain.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")")
assets=${HYDROSTAT_ASSETS:-$project/../shared/assets}
out=$project/out/balance clips="" variants=usual seeds=20 cycles=50 speed="" scene="" meshes=usual jobs=$(nproc) readme=""
while getopts o:c:v:s:n:p:w:m:j:r option; do
  case $option in
    o) out=$(realpath -m -- "$OPTARG") ;;
    c) clips=$OPTARG ;;
    v) variants=$OPTARG ;;
    s) seeds=$OPTARG ;;
    n) cycles=$OPTARG ;;
    p) speed=$OPTARG ;;
    w) scene=$(realpath -- "$OPTARG") ;;
    m) meshes=$OPTARG ;;
    j) jobs=$OPTARG ;;
    r) readme=README.md ;;
    *) exit 2 ;;
  esac
done

# name|file|options of 'hydrostat convert'
table="worm|$project/samples/worm_crawl.glb|
trot|$project/samples/boxdog_trot.fbx|
jump|$project/samples/boxdog_jump.glb|
fox_walk|$assets/gltf/fox.glb|--clip Walk --height 0.6
fox_run|$assets/gltf/fox.glb|--clip Run --height 0.6
frog|$assets/fbx/frog.fbx|--clip Frog_Jump --height 0.15
snake|$assets/gltf/snake.glb|--clip 'Side winding'
slime|$assets/fbx/slime.fbx|--clip Slime_Walk
cesium_man|$assets/gltf/cesium_man.gltf|
spider|$assets/gltf/spider_animated.gltf|--from 1.375 --to 2.125 --height 0.3"

cd -- "$project"
cmake --preset release > /dev/null
cmake --build --preset release --target hydrostat balance_run -j "$jobs" | tail -n 1
mkdir -p -- "$out/creatures" "$out/rows" "$out/frames"
program=$(cat build/release/hydrostat build/release/tests/balance_run | sha256sum | cut -c 1-16)

# Rows of another scene would be other rows.
world=$([ -z "$scene" ] || sha256sum "$scene" | cut -c 1-16)
if [ "$(cat "$out/scene" 2> /dev/null)" != "$world" ]; then
  rm -f -- "$out/rows/"* "$out/frames/"*
  echo "$world" > "$out/scene"
fi

# The creature that goes in a clip's variant.
creature_of() {
  if [[ $2 == polished* ]]; then echo "$1.polished"; else echo "$1"; fi
}
export -f creature_of
# Makes creatures/$1 by all that follows, unless this program did.
make_creature() {
  # A creature of another program would be another creature.
  [ "$(cat "$out/creatures/$1.made_by" 2> /dev/null)" != "$program" ] || return 0
  echo "converting $1"
  local outcome=0
  build/release/hydrostat convert -o "$out/creatures/$1" --quiet "${@:2}" > /dev/null || outcome=$?
  if [ "$outcome" != 0 ] && [ "$outcome" != 3 ]; then
    echo "$1: cannot be converted" >&2
    exit 1
  fi
  if [[ $1 == *.polished ]]; then
    rm -f -- "$out/rows/${1%.polished},polished"* "$out/frames/${1%.polished},polished"*
  else
    find "$out/rows" "$out/frames" -name "$1,*" ! -name "$1,polished*" -delete
  fi
  echo "$program" > "$out/creatures/$1.made_by"
}

names=()
while IFS='|' read -r name file options; do
  if [ -n "$clips" ] && [[ " $clips " != *" $name "* ]]; then continue; fi
  if [ ! -f "$file" ]; then
    echo "$name: left out, $file is missing (set HYDROSTAT_ASSETS)"
    continue
  fi
  eval "options=($options)"
  for mesh in $meshes; do
    body=$name nodes=()
    [ "$mesh" = usual ] || body=$name@$mesh nodes=(--nodes "$mesh")
    names+=("$body")
    for variant in $variants; do
      creature=$(creature_of "$body" "$variant")
      polish=()
      [ "$creature" = "$body" ] || polish=(--polish on)
      make_creature "$creature" "$file" "${options[@]}" "${nodes[@]}" "${polish[@]}"
    done
  done
done <<< "$table"

# One line a run: its name, which is its key in the table.
cases() {
  for seed in $(seq 1 "$seeds"); do
    for name in "${names[@]}"; do
      for variant in $variants; do echo "$name,$variant,$seed,none,$cycles"; done
    done
  done
  [ -n "$speed" ] || return 0
  for direction in 0 1 2 3 4 5 6 7; do
    for phase in 0 1 2 3; do
      for name in "${names[@]}"; do
        for variant in $variants; do echo "$name,$variant,0,$direction:$phase:$speed,12"; done
      done
    done
  done
}
run_case() {  # out name,variant,seed,push,cycles
  local row=$1/rows/$2 frames=()
  [ ! -f "$row" ] || return 0
  IFS=, read -r name variant seed push cycles <<< "$2"
  frames=(-)
  [ "$seed" != 1 ] || frames=("$1/frames/$name,$variant.json")
  build/release/tests/balance_run "$1/creatures/$(creature_of "$name" "$variant")" "$variant" "$seed" "$push" "$cycles" "${frames[@]}" ${scene:+"$scene"} > "$row.part" || return 1
  mv -- "$row.part" "$row"
}
export -f run_case
export scene
cases | xargs -d '\n' -P "$jobs" -I CASE bash -c 'run_case "$@"' _ "$out" CASE

{
  echo "clip,variant,seed,push,cycles_wanted,outcome,loop,cycles,time_s,shape,clip_shape,drift,heading_deg,travel,slip,penetration,real_time_factor,held_slip,momentum_mg,angular_mgl,assist_mg,guard_steps,feedback,buzz,style,style_least,fall_cause"
  cases | while read -r case; do echo "$case,$(cat -- "$out/rows/$case")"; done
} > "$out/balance.csv.part"
mv -- "$out/balance.csv.part" "$out/balance.csv"
echo "$out/balance.csv"
echo "file://$out/balance.html"
node tests/balance/page.mjs "$out" ${readme:+"$readme"}
