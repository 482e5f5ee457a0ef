# SPDX-License-Identifier: Apache-2.0
# Sourced by every script: $1 is the program, $2 a folder that the script may fill.
set -u
asbuilt=$1
here=$2
rm -rf "$here"
mkdir -p "$here"
cd "$here" || exit 1

fail() {
  echo "FAILED: $*" >&2
  [ -f stderr ] && sed 's/^/  stderr: /' stderr >&2
  exit 1
}

# expect CODE ARGUMENTS...: runs the program; its output is left in the files stdout and stderr.
expect() {
  code=$1
  shift
  "$asbuilt" "$@" >stdout 2>stderr
  got=$?
  [ "$got" -eq "$code" ] || fail "asbuilt $*: exit code $got, expected $code"
}

# says WORDS...: the last standard error holds every word.
says() {
  for word in "$@"; do
    grep -q -- "$word" stderr || fail "the message does not say '$word'"
  done
}

same() { cmp -s "$1" "$2" || fail "$1 and $2 differ"; }
absent() { [ ! -e "$1" ] || fail "$1 was left behind"; }
status_of() { grep -A14 "\"name\": \"$2\"" "$1/result.json" | grep '"status"' | head -n 1 | cut -d'"' -f4; }
field_of() { grep -A26 "\"name\": \"$2\"" "$1/result.json" | grep "\"$3\":" | head -n 1 | cut -d'"' -f4; }
# count_of FIELD: the number under a field of the JSON in stdout, the first of its name.
count_of() { grep "\"$1\":" stdout | head -n 1 | tr -dc '0-9'; }

# A small scene with the demonstration part: three scans that overlap.
small_scene() {
  expect 0 simulate demo:valve_body -o scene --scans 3 --points 25000 --seed 3 --clutter-objects 4
}
