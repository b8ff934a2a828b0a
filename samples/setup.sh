#!/usr/bin/env bash
# Installs what the build (and, with --tests, the tests; with --bench, the peer benchmark) needs and this Debian machine lacks,
# asking for nothing.
# A run that finds everything in place only asks dpkg.
set -euo pipefail

packages=(
  ca-certificates build-essential g++ cmake ninja-build ccache
  libassimp-dev libceres-dev libeigen3-dev libfftw3-dev libopenvdb-dev libboost-dev libboost-iostreams-dev libtbb-dev
  nlohmann-json3-dev libcli11-dev libssl-dev libtinygltf-dev libtomlplusplus-dev libseccomp-dev libgtest-dev
)
# Node may come from elsewhere, with its npm.
command -v node >/dev/null || packages+=(nodejs)
command -v npm >/dev/null || packages+=(npm)
if [ "${1:-}" = --tests ]; then
  command -v chromium >/dev/null || packages+=(chromium)
  packages+=(calculix-ccx valgrind)
fi
[ "${1:-}" != --bench ] || packages+=(libbenchmark-dev libbullet-dev)

command -v apt-get >/dev/null || {
  echo "setup.sh: apt-get: is not here. Install the counterparts of these Debian packages by hand: ${packages[*]}" >&2
  exit 1
}
missing=()
for package in "${packages[@]}"; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null || ! sudo -n true 2>/dev/null; then
    echo "setup.sh: packages are missing and can only be installed by root. Run as root: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo -n)
fi
echo "Installing ${missing[*]}"
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3)
"${apt[@]}" update
"${apt[@]}" install --no-install-recommends "${missing[@]}"
