# SPDX-License-Identifier: Apache-2.0
# Sourced by ./demo, ./test and the scripts beside this file, from the repository's root. POSIX sh.

say() { printf '\n== %s\n' "$*"; }

die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# How many compilers may run at once: one a core, but only as many as memory lasts for (1.5 GB each, as Eigen's
# templates ask for at worst).
jobs() {
  cores=$(nproc 2>/dev/null || echo 1)
  by_memory=$(awk '/^MemAvailable:/ { print int($2 / 1500000) }' /proc/meminfo 2>/dev/null)
  [ -n "$by_memory" ] || by_memory=$cores
  [ "$by_memory" -ge 1 ] || by_memory=1
  if [ "$by_memory" -lt "$cores" ]; then echo "$by_memory"; else echo "$cores"; fi
}

# configure_and_build PRESET "CMAKE OPTIONS" [TARGET...]
configure_and_build() {
  preset=$1
  options=$2
  shift 2
  say "Configuring build/$preset"
  # Where ccache is installed, what was compiled before is not compiled again.
  if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER-ccache}"; fi
  # The options are a list of words.
  # shellcheck disable=SC2086
  cmake --preset "$preset" $options || die "CMake could not configure build/$preset; the reason stands above"
  say "Building in build/$preset with $(jobs) job(s)"
  if [ $# -gt 0 ]; then
    cmake --build "build/$preset" --parallel "$(jobs)" --target "$@" || die "the build failed; the first error above says why"
  else
    cmake --build "build/$preset" --parallel "$(jobs)" || die "the build failed; the first error above says why"
  fi
}
