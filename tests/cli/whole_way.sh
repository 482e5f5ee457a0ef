# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"
small_scene
model=scene/model.ply
scans="scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply"

# ---- the same bytes whatever the thread count
for threads in 1 2 3; do
  # shellcheck disable=SC2086
  expect 0 reconstruct "$model" $scans -o "r$threads" --threads $threads --mesh --watertight --json
  cp stdout "stdout$threads"
  same "stdout$threads" "r$threads/result.json"
done
for file in result.json reconstruction.ply mesh.ply mesh_watertight.ply report.json report.html; do
  same "r1/$file" "r2/$file"
  same "r1/$file" "r3/$file"
done

# ---- the mesh is one that other programs can read, about as large as the part
expect 0 info r1/mesh.ply --json
grep -q '"kind": "mesh"' stdout || fail "mesh.ply is no mesh"
[ "$(count_of triangles)" -gt 1000 ] || fail "mesh.ply has $(count_of triangles) triangles"
expect 0 inspect "$model" r1/mesh.ply -o mesh_report --tolerance -5,5

# ---- detect, then register: the same as reconstruct
# shellcheck disable=SC2086
expect 0 detect "$model" $scans -o detected
expect 0 register detected -o registered --mesh --watertight
for file in result.json reconstruction.ply mesh.ply mesh_watertight.ply points.csv; do same "r1/$file" "registered/$file"; done
# The report says by which command it was made.
for run in r1 registered; do sed '/"command": {/,/}/d' $run/report.json >report_of_$run.json; done
same report_of_r1.json report_of_registered.json
for file in r1/segments/*; do same "$file" "registered/segments/$(basename "$file")"; done

# ---- spread over runs, the scans come together again
i=0
for scan in $scans; do
  expect 0 detect "$model" "$scan" -o "part$i"
  i=$((i + 1))
done
expect 0 register part0 part1 part2 -o spread
same r1/reconstruction.ply spread/reconstruction.ply

# ---- a prepared model stands wherever the model does
expect 0 prepare "$model" -o part.asbuilt
expect 0 info part.asbuilt --json
grep -q '"kind": "prepared"' stdout || fail "info does not know a prepared model"
expect 0 detect part.asbuilt scene/scan_00.ply -o from_prepared
sed 's/part.asbuilt/scene\/model.ply/' from_prepared/result.json >renamed.json
same part0/result.json renamed.json

# ---- tolerance: 6 when it is exceeded
expect 6 register detected -o tight --tolerance -0.0001,0.0001
expect 6 inspect "$model" r1/reconstruction.ply -o tight_report --tolerance -0.0001,0.0001
expect 0 inspect "$model" r1/reconstruction.ply -o report --tolerance -5,5 --json
same stdout report/report.json
grep -q '"part": "pass"' report/report.json || fail "the verdict is not pass"

# ---- a graph in pieces: 5, also when it is out of tolerance; each piece is told
expect 5 register detected -o pieces --graph-low 1 --graph-high 1 --tolerance -0.0001,0.0001
says disconnected overlap 'best missing link is scan_0'
[ "$(grep -c '"status": "disconnected"' pieces/result.json)" -eq 2 ] || fail "two scans should hang loose"
absent pieces/mesh.ply

# ---- the user's own choices are carried out and written down
"$asbuilt" register detected -o without --exclude scan_01 >/dev/null 2>stderr
[ "$(field_of without scan_01 reason_code)" = excluded ] || fail "--exclude was not carried out"
grep -q '"joint_exclude": \["scan_01"\]' without/result.json || fail "--exclude was not written down"
expect 2 register detected -o nobody --exclude nobody
absent nobody
expect 0 detect "$model" scene/scan_00.ply -o vouched --accept scan_00:0
[ "$(field_of vouched scan_00 reason_code)" = accepted_by_user ] || fail "--accept was not written down"

# ---- other software goes on with it, and so do we
expect 0 export r1 -o poses.csv
[ "$(wc -l <poses.csv)" -eq 4 ] || fail "poses.csv has $(wc -l <poses.csv) lines, expected a header and three poses"
expect 0 detect "$model" scene/scan_00.ply -o again --poses poses.csv
expect 0 export r1 -o aligned.e57
expect 0 info aligned.e57 --json
[ "$(grep -c '"has_pose": true' stdout)" -eq 3 ] || fail "aligned.e57 does not hold three scans with poses"
expect 4 export r1 -o aligned.e57
expect 2 export r1 -o aligned.doc

# ---- words and figures
expect 0 explain r1
grep -q 'scan_00 .* is accepted' stdout || fail "explain does not say what became of a scan"
for words in 'Should be visible: [0-9]' 'was found where the model has it' 'is denied (allowed: 3 %)' 'was seen through' \
  'nothing came back' 'Normals: [0-9]* % .*(needed: 65 %)' 'Scatter: .* mm (RMS)' \
  'past [0-9]* % of the part.s edges the surface goes on (allowed: 12 %)' 'Runner-up: ' 'is linked to scan_0'; do
  grep -q "$words" stdout || fail "explain does not say '$words'"
done
expect 0 explain r1 scan_01
grep -q scan_00 stdout && grep -q '^scan_00' stdout && fail "explain speaks of a scan nobody asked for"
expect 2 explain r1 nobody
expect 0 evaluate scene r1 --json
grep -q '"wrong": 0' stdout || fail "a wrong pose was accepted"
expect 0 info r1 "$model" scene/scan_00.ply --json
for kind in result mesh scan; do grep -q "\"kind\": \"$kind\"" stdout || fail "info knows no $kind"; done
grep -qi 'nan\|inf' r1/result.json r1/report.json && fail "a number that JSON does not know was written"
echo passed
