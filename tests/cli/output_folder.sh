# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"
small_scene
model=scene/model.ply

# How many scans the last run in a folder judged; a stage may come more than once for each.
scans_worked_on() { grep -A1 '"stage": "verify"' "$1/timing.json" | grep '"scan"' | sort -u | wc -l; }

# ---- a folder that is not ours is not touched, and nothing is computed first
mkdir foreign
echo precious >foreign/result.json
expect 4 reconstruct "$model" scene/scan_00.ply -o foreign
says foreign --force
[ "$(cat foreign/result.json)" = precious ] || fail "a foreign folder was touched"
[ "$(ls foreign | wc -l)" -eq 1 ] || fail "something was written into a foreign folder"
expect 4 detect missing.stl scene/scan_00.ply -o foreign

# ---- places that cannot be written (root may write anywhere else)
echo file >file
for place in file file/below /proc/asbuilt_out /dev/full /dev/full/below; do
  expect 4 detect "$model" scene/scan_00.ply -o "$place"
done
[ "$(cat file)" = file ] || fail "a file in the way was touched"
expect 4 prepare "$model" -o file
expect 4 prepare "$model" -o file/below
[ -c /dev/full ] || fail "/dev/full was replaced"

# ---- the folder belongs to the command that made it
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply -o detected
cp detected/result.json before.json
expect 4 reconstruct "$model" scene/scan_00.ply -o detected
expect 4 register detected -o detected
same before.json detected/result.json
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply -o detected
same before.json detected/result.json
[ "$(scans_worked_on detected)" -eq 0 ] || fail "finished scans were worked on again"
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply -o detected --force
[ "$(scans_worked_on detected)" -eq 2 ] || fail "--force did not start anew"
same before.json detected/result.json

# ---- another model: neither goes on in the same folder nor is registered with this one
expect 0 simulate demo:valve_body -o other --scans 1 --points 5000 --scale 1.01
sed 's/^end_header/comment other\nend_header/' other/model.ply >other.ply
expect 4 detect other.ply scene/scan_00.ply -o detected
says "another model"
expect 0 detect other.ply scene/scan_00.ply -o detected_other
expect 2 register detected detected_other -o mixed
says "another model"
absent mixed

# ---- killed in the middle: nothing half-written, and the same command goes on
"$asbuilt" detect "$model" scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o killed >/dev/null 2>&1 &
running=$!
waited=0
until grep -q '"name"' killed/result.json 2>/dev/null; do
  sleep 0.1
  waited=$((waited + 1))
  [ $waited -lt 1200 ] || fail "no checkpoint appeared"
done
kill -9 $running 2>/dev/null
wait $running 2>/dev/null
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o killed
grep -q '"state": "complete"' killed/result.json || fail "the run was not completed"
[ "$(scans_worked_on killed)" -lt 3 ] || fail "nothing of the killed run was kept"
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o whole
same whole/result.json killed/result.json

# ---- interrupted: 130, partial, goes on
"$asbuilt" detect "$model" scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o stopped >/dev/null 2>stderr &
running=$!
until [ -e stopped/timing.json ]; do sleep 0.05; done
kill -TERM $running
wait $running
[ $? -eq 130 ] || fail "an interrupted run did not leave with 130"
if [ -e stopped/result.json ]; then
  grep -q '"state": "partial"' stopped/result.json || fail "an interrupted run is not partial"
fi
expect 0 detect "$model" scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o stopped
same whole/result.json stopped/result.json
[ -z "$(find . -name '*.tmp')" ] || fail "temporary files were left behind: $(find . -name '*.tmp')"
echo passed
