# SPDX-License-Identifier: Apache-2.0
# Inspection by itself: verdicts and exit codes, tolerance files, alignment, check points, pictures.
. "$(dirname "$0")/common.sh"
small_scene
model=scene/model.ply
as_built=scene/as_built.ply  # the true part, all of it

expect 0 inspect "$model" "$as_built" -o plain
for file in report.html report.json points.csv faces.csv regions.csv deviation.ply timing.json; do
  [ -s "plain/$file" ] || fail "plain/$file is missing"
done
[ ! -e plain/views ] || fail "views were written without --views"
grep -q '"part": null' plain/report.json || fail "a verdict without a tolerance"

# ---- the verdict decides on the exit code
expect 0 inspect "$model" "$as_built" -o wide --tolerance -50,50 --json
same stdout wide/report.json
grep -q '"part": "pass"' wide/report.json || fail "the verdict is not pass"
expect 6 inspect "$model" "$as_built" -o tight --tolerance -0.0001,0.0001
grep -q '"part": "fail"' tight/report.json || fail "the verdict is not fail"

# ---- the same bytes whatever the thread count
expect 0 inspect "$model" "$as_built" -o one --tolerance -50,50 --threads 1 --views
expect 0 inspect "$model" "$as_built" -o three --tolerance -50,50 --threads 3 --views
for file in report.json report.html points.csv deviation.ply views/corner.png; do same "one/$file" "three/$file"; done

# ---- tolerance files
printf 'name,low,high,x1,y1,z1,x2,y2,z2\n*,-50,50\neverywhere,-0.0001,0.0001,-1e6,-1e6,-1e6,1e6,1e6,1e6\n' >tolerances.csv
expect 6 inspect "$model" "$as_built" -o boxes --tolerance tolerances.csv
grep -q '"name": "everywhere"' boxes/report.json || fail "the box is not in the report"
printf '*,-1,1\n*,-2\n' >bad.csv
expect 3 inspect "$model" "$as_built" -o bad --tolerance bad.csv
grep -q 'bad.csv, line 2' stderr || fail "the line is not named: $(cat stderr)"
absent bad
expect 2 inspect "$model" "$as_built" -o bad --tolerance no_such_file.csv
expect 2 inspect "$model" "$as_built" -o bad --tolerance 1,-1

# ---- alignment is written down, and is no scale
expect 0 inspect "$model" "$as_built" -o fitted --alignment best-fit
grep -q '"method": "best fit"' fitted/report.json || fail "the alignment is not written down"
expect 2 inspect "$model" "$as_built" -o bad --align-on faces:1

# ---- check points
printf 'P1,0,0,1000,0.1\n' >points.csv
expect 0 inspect "$model" "$as_built" -o checked --reference points.csv
grep -q 'P1,0,0,1000,0.1,,,not scanned' checked/reference.csv || fail "$(cat checked/reference.csv)"
