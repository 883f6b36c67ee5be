# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash
# The demo and the tests source this file. It installs missing Debian packages, configures and builds.
# If everything is there, it needs no network and changes nothing.

set -euo pipefail

# The project's root, wherever the script is called from.
hybrid_root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
readonly hybrid_root
hybrid_install=yes
hybrid_flags=()      # options of the script that sources this one, and a line of help for each
hybrid_flag_help=()
hybrid_given=' '
hybrid_stage_name=''
hybrid_stage_start=0

say() { printf '%s\n' "$*"; }

# refuse WHAT REMEDY…: prints both on standard error, and ends the script.
refuse() {
  printf '\nerror: %s\n' "$1" >&2
  shift
  if (($#)); then printf '       %s\n' "$@" >&2; fi
  exit 1
}

# stage [NAME]: ends the present stage and prints its time, then begins NAME. Without a name, no stage begins.
stage() {
  if [[ -n $hybrid_stage_name ]]; then
    say "== $hybrid_stage_name: done in $((SECONDS - hybrid_stage_start)) s"
  fi
  hybrid_stage_name=${1-}
  hybrid_stage_start=$SECONDS
  if [[ -n $hybrid_stage_name ]]; then say "== $hybrid_stage_name"; fi
}

# read_options PURPOSE ARGUMENTS…: reads the options of the script. PURPOSE is a line of its help.
read_options() {
  local purpose=$1 argument
  shift
  for argument in "$@"; do
    case $argument in
      --no-install) hybrid_install=no ;;
      -h | --help)
        usage
        say "$purpose"
        say '  --no-install  build with what is installed; never call apt-get'
        if ((${#hybrid_flag_help[@]})); then printf '  %s\n' "${hybrid_flag_help[@]}"; fi
        exit 0
        ;;
      *)
        if [[ " ${hybrid_flags[*]-} " != *" $argument "* ]]; then
          printf 'error: unknown option %s\n' "$argument" >&2
          usage >&2
          exit 2
        fi
        hybrid_given+="$argument "
        ;;
    esac
  done
}

usage() {
  local flag line="usage: bash $(basename -- "$0") [--no-install]"
  for flag in "${hybrid_flags[@]}"; do line+=" [$flag]"; done
  say "$line"
}

# given FLAG: whether the script was called with this flag.
given() { [[ $hybrid_given == *" $1 "* ]]; }

# Prints the packages of packages.txt, one per line.
listed_packages() { sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' -- "$hybrid_root/packages.txt"; }

# Prints the listed packages that are not installed.
missing_packages() {
  local installed
  installed=$(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' | sed -n 's/^installed //p')
  listed_packages | grep -Fxv -f <(printf '%s\n' "$installed") || true
}

install_packages() {
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    say 'This is not a Debian system: going on with what is installed (packages.txt lists what is needed).'
    return
  fi
  local -a missing
  mapfile -t missing < <(missing_packages)
  if ((${#missing[@]} == 0)); then return; fi

  local -a as_root=()
  local by_hand="apt-get install --no-install-recommends ${missing[*]}"
  if [[ $hybrid_install == no ]]; then
    say "Not installed, as asked: ${missing[*]}"
    say "If the build fails for want of them: $by_hand"
    return
  fi
  stage "install ${#missing[@]} of $(listed_packages | wc -l) packages, by apt-get"
  say "${missing[*]}"
  if [[ $(id -u) != 0 ]]; then
    command -v sudo >/dev/null ||
      refuse 'packages are missing, and installing them needs root; there is no sudo here.' \
        "As root, run: $by_hand" 'and start this script again.'
    as_root=(sudo)
    # Without a terminal nobody can type a password, so sudo must not ask for one.
    if [[ ! -t 0 ]]; then as_root=(sudo -n); fi
    "${as_root[@]}" true || refuse 'packages are missing, and sudo did not allow installing them.' \
      "As root, run: $by_hand" 'and start this script again.'
  fi
  local -a apt=(env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300)
  "${as_root[@]}" "${apt[@]}" update ||
    refuse 'the lists of packages could not be fetched.' 'Is there a network? Then start this script again.'
  # apt prints two lines for each of some hundred packages. They go to a log, which is shown only after a failure.
  local log
  log=$(mktemp)
  if ! "${as_root[@]}" "${apt[@]}" install --no-install-recommends "${missing[@]}" >"$log" 2>&1; then
    tail -n 40 -- "$log" >&2
    rm -f -- "$log"
    refuse 'the packages could not be installed (apt-get said the above).' \
      'This project is built on Debian 12. Mend what apt-get names, and start this script again.'
  fi
  rm -f -- "$log"
}

# Number of parallel compilers: at most one per processor and per 1.5 GB of memory (CGAL and ITK take that much).
build_jobs() {
  local processors memory_kb jobs
  processors=$(nproc)
  memory_kb=$(sed -n 's/^MemAvailable: *\([0-9]*\) kB$/\1/p' /proc/meminfo 2>/dev/null || true)
  jobs=$processors
  if [[ -n $memory_kb ]] && ((memory_kb / 1500000 < jobs)); then jobs=$((memory_kb / 1500000)); fi
  if ((jobs < 1)); then jobs=1; fi
  printf '%s\n' "$jobs"
}

# True if the build folder was configured for this checkout at its present path. ninja itself notices changed files.
is_configured() {
  local cache=$1/CMakeCache.txt
  [[ -f $1/build.ninja && -f $cache ]] && grep -Fxq "CMAKE_HOME_DIRECTORY:INTERNAL=$hybrid_root" "$cache"
}

# build TARGET: builds the target in build/release. Prints nothing if it is up to date.
build() {
  local target=$1 folder=$hybrid_root/build/release
  command -v cmake >/dev/null || refuse 'cmake is missing.' 'packages.txt lists what is needed to build.'
  command -v ninja >/dev/null || refuse 'ninja is missing.' 'packages.txt lists what is needed to build.'
  if ! is_configured "$folder"; then
    stage 'configure'
    # CMake refuses a build folder that was copied from elsewhere, so the folder is configured anew.
    local -a fresh=()
    if [[ -f $folder/CMakeCache.txt ]]; then fresh=(--fresh); fi
    (cd -- "$hybrid_root" && cmake "${fresh[@]}" --preset release) ||
      refuse 'the build could not be configured (CMake said the above).' \
        'Is a package of packages.txt missing?'
  fi
  if ninja -C "$folder" -n "$target" 2>/dev/null | grep -q 'no work to do'; then return; fi
  local jobs
  jobs=$(build_jobs)
  stage "build $target, $jobs at a time"
  NINJA_STATUS='[%f/%t, %e s] ' ninja -C "$folder" -j "$jobs" "$target" ||
    refuse 'the build failed (the compiler said the above).'
}
