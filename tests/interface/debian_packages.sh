#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# debian_packages.sh BUILD FOLDER: makes the four Debian packages of a finished release build, checks them with lintian, and
# installs them in a fresh Debian 12 below FOLDER. There it builds and runs programs through CMake, pkg-config and Python, and
# the program itself, as an ordinary user. Then it purges the packages and compares the files before and after.
# It needs root, the network, and the packages debootstrap and lintian, so ctest does not run it. It takes up to ten
# minutes and 2 GB.
set -euo pipefail
build=$(realpath -- "$1") folder=$(realpath -m -- "$2") here=$(cd -- "$(dirname -- "$0")" && pwd)

fail() {
  printf 'error: %s\n' "$*" >&2
  exit 1
}
[[ $(id -u) == 0 ]] || fail 'a root of its own needs root: call this with sudo'
for tool in cpack debootstrap lintian; do
  command -v $tool >/dev/null || fail "$tool is missing: apt-get install cmake debootstrap lintian"
done
mkdir -p -- "$folder"

echo '== packages'
rm -rf -- "$folder/packages"
(cd -- "$build" && cpack -B "$folder/packages" >"$folder/cpack.log" 2>&1) || fail "cpack failed: $folder/cpack.log"
rm -rf -- "$folder/packages/_CPack_Packages"
packages=("$folder"/packages/*.deb)
((${#packages[@]} == 4)) || fail "cpack made ${#packages[@]} packages, not 4"
lintian --allow-root --fail-on error "${packages[@]}" || fail 'lintian finds errors in the packages'

# debootstrap runs once. Each call begins from a copy of its result.
root=$folder/root
if [[ ! -f $folder/clean.tar ]]; then
  echo '== a fresh Debian 12'
  rm -rf -- "$root"
  debootstrap --variant=minbase bookworm "$root" >"$folder/debootstrap.log" || fail "debootstrap: $folder/debootstrap.log"
  tar -C "$root" -cf "$folder/clean.tar" .
fi
rm -rf -- "$root"
mkdir -- "$root"
tar -C "$root" -xpf "$folder/clean.tar"
cp -- /etc/resolv.conf "$root/etc/resolv.conf"
mount -t proc proc "$root/proc"
trap 'umount "$root/proc"' EXIT

inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
as_user() { chroot --userspec=nobody:nogroup "$root" env -i PATH=/usr/bin:/bin HOME=/tmp LC_ALL=C.UTF-8 bash -ec "cd /tmp/user; $1"; }
apt() { inside apt-get -q -y "$@" >>"$folder/apt.log" 2>&1 || fail "apt-get $*: $folder/apt.log"; }
# Lists the files of the root, without temporary files and without the records of apt and dpkg.
files() { (cd -- "$root" && find . \( -path ./proc -o -path ./tmp -o -path ./packages -o -path ./var/cache -o -path ./var/log \
  -o -path ./var/lib/apt -o -path ./var/lib/dpkg \) -prune -o -print | sort); }

echo '== install'
: >"$folder/apt.log"
apt update
apt install --no-install-recommends gcc libc6-dev cmake make pkg-config # for a user's own project
files >"$folder/before.txt"
mkdir -- "$root/packages"
cp -- "${packages[@]}" "$root/packages"
mapfile -t names < <(printf '/packages/%s\n' "${packages[@]##*/}")
apt install "${names[@]}"

echo '== use'
install -d -o nobody -g nogroup -- "$root/tmp/user"
cp -r -- "$here/outside" "$root/tmp/user/"
scenes=/usr/share/hybrid/scenes
as_user "hybrid run $scenes/cube.toml --samples 0 --plot cube.svg --picture cube.png --record cube.rec"
as_user 'hybrid replay cube.rec | grep "equal:"'
example=$(inside dpkg -L libhybrid-dev | grep '/press\.c$')
as_user "cmake -S outside -B by-cmake -DPRESS=$example >cmake.log; cmake --build by-cmake >>cmake.log
         by-cmake/press $scenes/cube.toml"
as_user "cc -std=c11 -Wall -Wextra -Werror $example \$(pkg-config --cflags --libs hybrid) -o by-pkg-config
         ./by-pkg-config $scenes/cube.toml >by-pkg-config.txt; hybrid replay press.rec | grep 'equal: 1000'"
as_user "python3 $(dirname -- "$example")/press.py $scenes/cube.toml press.svg"
as_user "zcat /usr/share/man/man1/hybrid.1.gz | grep -q 'SS hybrid run'; source /usr/share/bash-completion/completions/hybrid"

echo '== purge'
apt purge hybrid 'libhybrid*' python3-hybrid
# By default apt keeps packages that another package recommends or suggests.
apt autoremove --purge -o APT::AutoRemove::RecommendsImportant=false -o APT::AutoRemove::SuggestsImportant=false
rm -rf -- "$root/tmp/user"
files >"$folder/after.txt"
diff "$folder/before.txt" "$folder/after.txt" || fail 'files are left (>) or gone (<) after the purge'
echo 'built, installed, used, and removed without a trace'
