#!/usr/bin/env bash
# Makes the pictures and the measured tables of README anew:  samples/figures.sh [WHAT...]
#   scenes    pictures of the scenes' accuracy and effects                          minutes
#   creature  the trot's own curve of accuracy                                      a quarter of an hour
#   chosen    what convert --max-error 2% chooses for worm, trot and fox  ten minutes
#   polish    what convert --polish on does (clips that are not ours as above)                  an hour
#   levels    levels of detail, table and picture (clips that are not ours from HYDROSTAT_ASSETS, where they are there)  an hour
#   speed     what the stages of a conversion cost                                  minutes
#   import    what reading the samples costs                                        seconds
#   damping   explicit against implicit over damping and stiffness (installs what tests/bench/run.sh wants)   a quarter of an hour
#   peers     our methods against Bullet's (the same)                               a quarter of an hour
#   stability the suite of hard scenes; runs that are there are not run again                  hours
#   draw      tables and pictures from what was measured before (samples/figures/*.csv): seconds, also only where named
# Without WHAT all but the last. HYDROSTAT names another program than build/release/hydrostat, which is built where it is not
# there. Times are this machine's. What is measured goes to out/figures/; a creature that is there is not converted again.
set -euo pipefail
project=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")
hydrostat=${HYDROSTAT:-$project/build/release/hydrostat}
assets=${HYDROSTAT_ASSETS:-$project/../shared/assets}
figures=$project/samples/figures readme=${HYDROSTAT_README:-$project/README.md}
out=$project/out/figures

if [ ! -x "$hydrostat" ]; then
  cd -- "$project"
  cmake --preset release
  cmake --build --preset release --target hydrostat -j "${HYDROSTAT_BUILD_JOBS:-$(nproc)}"
fi
mkdir -p -- "$figures" "$out"

table() {  # KIND ENDING MEASURED...
  node "$project/samples/figures.mjs" "$1" "$figures/$1.$2" "$readme" "${@:3}"
}
curve() {  # SCENE OPTION...
  "$hydrostat" bench accuracy "$project/samples/scenes/$1.toml" -o "$out/$1" --quiet "${@:2}"
  cp -- "$out/$1/accuracy.svg" "$figures/accuracy_$1.svg"
}
make_creature() {  # NAME CLIP OPTION...
  [ -f "$out/$1/creature.toml" ] || "$hydrostat" convert "$2" -o "$out/$1" --quiet "${@:3}" || [ $? = 3 ]
}
make_levels() {  # NAME CLIP OPTION...: a report a level, of a quarter to four times the nodes
  if [ ! -f "$2" ]; then
    echo "figures.sh: $2: is not there. The rows of '$1' stay as they are."
    return
  fi
  make_creature "$@"
  local solved
  solved=$(node -p 'JSON.parse(fs.readFileSync(process.argv[1])).nodes.length' "$out/$1/body.json")
  local part
  for part in 25 50 100 200 400; do
    local nodes=$((solved * part / 100))
    [ "$nodes" -ge 20 ] || continue
    "$hydrostat" replay "$out/$1" --lod "$nodes" --duration 4 --json --quiet > "$out/reports/$1.$part.json" || [ $? = 3 ]
    reports+=("$out/reports/$1.$part.json")
  done
}

run_scenes() {
  curve clamped_bar --duration 0.2 --max-error 0.05%
  curve bouncing_circle
  "$hydrostat" bench effects "$project/samples/scenes/swimming_eel.toml" -o "$out/eel"
  cp -- "$out/eel/effects.svg" "$figures/effects_swimming_eel.svg"
}
run_creature() {
  make_creature boxdog_trot "$project/samples/boxdog_trot.fbx"
  "$hydrostat" bench accuracy "$out/boxdog_trot" -o "$out/trot" --max-error 2% --duration 0.2 --quiet
  cp -- "$out/trot/accuracy.svg" "$figures/accuracy_boxdog_trot.svg"
}
run_chosen() {
  local creatures=()
  choose() {  # NAME CLIP OPTION...
    if [ ! -f "$2" ]; then
      echo "figures.sh: $2: is not there. The row of '$1' stays as it is."
      return
    fi
    "$hydrostat" convert "$2" -o "$out/chosen/$1" --max-error 2% --quiet "${@:3}" || [ $? = 3 ]
    creatures+=("$out/chosen/$1")
  }
  choose boxdog_trot "$project/samples/boxdog_trot.fbx"
  choose worm_crawl "$project/samples/worm_crawl.glb"
  choose fox "$assets/gltf/fox.glb" --clip Walk --height 0.6
  table chosen csv "${creatures[@]}"
}
run_polish() {
  local creatures=()
  polish() {  # NAME CLIP OPTION...: converted with it and without
    if [ ! -f "$2" ]; then
      echo "figures.sh: $2: is not there. The row of '$1' stays as it is."
      return
    fi
    local way
    for way in off on; do
      "$hydrostat" convert "$2" -o "$out/polish/$1/$way" --polish "$way" --quiet "${@:3}" || [ $? = 3 ]
    done
    creatures+=("$out/polish/$1")
  }
  polish worm_crawl "$project/samples/worm_crawl.glb"
  polish boxdog_trot "$project/samples/boxdog_trot.fbx"
  polish 'boxdog_trot --nodes 50' "$project/samples/boxdog_trot.fbx" --nodes 50
  polish boxdog_jump "$project/samples/boxdog_jump.glb"
  polish 'fox --height 0.6' "$assets/gltf/fox.glb" --clip Walk --height 0.6
  polish frog "$assets/fbx/frog.fbx" --clip Frog_Jump --height 0.15
  polish snake "$assets/gltf/snake.glb" --clip 'Side winding'
  polish slime "$assets/fbx/slime.fbx" --clip Slime_Walk
  polish spider "$assets/gltf/spider_animated.gltf" --from 1.375 --to 2.125 --height 0.3
  table polish csv "${creatures[@]}"
}
run_levels() {
  mkdir -p -- "$out/reports"
  reports=()
  make_levels boxdog_trot "$project/samples/boxdog_trot.fbx"
  make_levels worm_crawl "$project/samples/worm_crawl.glb"
  make_levels snake "$assets/gltf/snake.glb" --clip 'Side winding'
  make_levels fox "$assets/gltf/fox.glb" --clip Walk --height 0.6
  table levels csv "${reports[@]}"
}
run_speed() {
  "$hydrostat" bench speed "$project/samples/boxdog_trot.fbx" -o "$out/speed" --nodes 150,300,500 --duration 1 --quiet > "$out/speed.txt"
  table speed txt "$out/speed.txt"
}
run_import() {
  "$hydrostat" bench import "$project/samples" -o "$out/import" > /dev/null
  table import csv "$out/import/import.csv"
}
run_damping() {
  "$project/tests/bench/run.sh" damping -o "$out/damping"
  table damping csv "$out/damping/damping.csv"
}
run_peers() {
  "$project/tests/bench/run.sh" peers -o "$out/peers" || [ $? = 1 ]  # which tells that a goal was missed
  table peers csv "$out/peers/peers.csv"
}
run_stability() { "$project/tests/stability/run.sh" && "$project/tests/stability/run.sh" -r; }
run_draw() {
  local kept
  for kept in levels.csv chosen.csv polish.csv peers.csv damping.csv import.csv speed.txt; do
    [ ! -f "$figures/$kept" ] || table "${kept%.*}" "${kept##*.}"
  done
}

[ $# -gt 0 ] || set -- scenes creature chosen polish levels speed import damping peers stability
for what; do
  [ "$(type -t "run_$what")" = function ] || {
    echo "figures.sh: '$what' is nothing that it makes. Name scenes, creature, chosen, polish, levels, speed, import, damping, peers, stability or draw." >&2
    exit 2
  }
done
for what; do
  "run_$what"
  echo "$what: done"
done
