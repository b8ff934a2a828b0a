#!/bin/bash
# Opens a report page in headless Chromium and fails if its script does: bash tests/page.sh REPORT.html [PICTURE.png]
# A picture, if asked for, shows the page at 1.25 s.
set -euo pipefail
page=$(realpath "$1")
profile=$(mktemp -d)
trap 'rm -rf "$profile"' EXIT
open_page() {  # options...: the page as it stands after four seconds of its own time
  timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking \
    --disable-component-update --disable-sync --use-angle=swiftshader --enable-unsafe-swiftshader --user-data-dir="$profile" \
    --virtual-time-budget=4000 --window-size=1400,900 --enable-logging=stderr "$@" "file://$page#t=1.25"
}
open_page --dump-dom > "$profile/dom" 2> "$profile/log"
if grep -E 'CONSOLE.*(Uncaught|Error)' "$profile/log"; then echo "$page: its script fails" >&2; exit 1; fi
grep -q '<output id="clock">1.25 / ' "$profile/dom" || { echo "$page: its clock does not stand at 1.25 s" >&2; exit 1; }
if grep -q 'id="view" class="is_empty"' "$profile/dom"; then echo "$page: it shows no 3D view" >&2; exit 1; fi
if [ $# -gt 1 ]; then open_page --screenshot="$(realpath "$2")" 2> "$profile/log"; fi
