# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"
expect 0 simulate demo:valve_body -o two --scans 2 --points 40000 --seed 5 --instances 2 --clutter-objects 2 --hidden-high 0.1
grep -q 'in 2 places' stdout || fail "simulate does not say that the part is there twice"
[ "$(grep -c other_placements two/truth.json)" -eq 2 ] || fail "truth.json lacks other_placements"
expect 0 simulate demo:valve_body -o one --scans 1 --points 25000 --seed 3 --clutter-objects 4
model=two/model.ply
scans="two/scan_00.ply two/scan_01.ply"

# ---- by default a second placement is ambiguous: 1 when nothing else is accepted, 5 when something is
# shellcheck disable=SC2086
expect 1 detect "$model" $scans -o ambiguous
for scan in scan_00 scan_01; do
  [ "$(status_of ambiguous $scan)" = ambiguous ] || fail "$scan is $(status_of ambiguous $scan)"
  [ "$(field_of ambiguous $scan reason_code)" = second_instance ] || fail "$scan has another reason than second_instance"
done
expect 5 detect "$model" one/scan_00.ply two/scan_01.ply -o mixed
expect 0 explain ambiguous scan_00
grep -q -- '--instances all' stdout || fail "explain does not name the option that helps"

# ---- all of them: entries and segments of their own, right against the truth, the same bytes for any thread count
expect 2 detect "$model" two/scan_00.ply -o none --instances some
absent none
# shellcheck disable=SC2086
expect 0 detect "$model" $scans -o all --instances all --threads 2
# shellcheck disable=SC2086
expect 0 detect "$model" $scans -o all1 --instances all --threads 1
same all/result.json all1/result.json
[ "$(ls all/segments | wc -l)" -eq 4 ] || fail "there are $(ls all/segments | wc -l) segments, expected 4"
for file in all/segments/*; do same "$file" "all1/segments/$(basename "$file")"; done
for name in scan_00 scan_00#2 scan_01 scan_01#2; do
  [ "$(status_of all "$name")" = accepted ] || fail "$name is '$(status_of all "$name")', expected accepted"
done
expect 0 evaluate two all --json
[ "$(count_of present)" -eq 4 ] || fail "evaluate counts $(count_of present) placements, expected 4"
[ "$(count_of right)" -eq 4 ] || fail "only $(count_of right) placements are right"
[ "$(count_of wrong)" -eq 0 ] || fail "$(count_of wrong) placements are wrong"

# ---- going on takes over all entries of a scan, or none
cp all/result.json before.json
# shellcheck disable=SC2086
expect 0 detect "$model" $scans -o all --instances all
same before.json all/result.json
grep -q '"stage": "verify"' all/timing.json && fail "finished scans were worked on again"

# ---- single placements can be named
expect 0 explain all scan_00#2
grep -q '^scan_00#2 .* is accepted' stdout || fail "explain does not know scan_00#2"
grep -q '^scan_00 ' stdout && fail "explain speaks of a placement nobody asked for"
expect 0 explain all scan_00
[ "$(grep -c '^scan_00.* is accepted' stdout)" -eq 2 ] || fail "explain scan_00 should speak of both placements"
"$asbuilt" register all -o joint >/dev/null 2>stderr
[ -e joint/reconstruction.ply ] || fail "register cannot work on placements"
"$asbuilt" register all -o joint_without --exclude scan_00#1 >/dev/null 2>stderr
[ "$(field_of joint_without scan_00 reason_code)" = excluded ] || fail "--exclude scan_00#1 was not carried out"
[ "$(status_of joint_without scan_00#2)" != rejected ] || fail "--exclude scan_00#1 took scan_00#2 away"
expect 0 detect "$model" two/scan_00.ply -o left_out --instances all --exclude scan_00#2
[ "$(field_of left_out scan_00#2 reason_code)" = excluded ] || fail "--exclude scan_00#2 was not carried out"
[ "$(ls left_out/segments | wc -l)" -eq 1 ] || fail "the segment of an excluded placement was kept"
"$asbuilt" register all -o joint_vouched --accept scan_01#2:0 >/dev/null 2>stderr
expect 0 detect "$model" two/scan_01.ply -o vouched --instances all --accept scan_01#2:0
for folder in joint_vouched vouched; do
  [ "$(field_of $folder scan_01#2 reason_code)" = accepted_by_user ] || fail "$folder: --accept was not carried out"
  [ "$(field_of $folder scan_01 reason_code)" != accepted_by_user ] || fail "$folder: --accept was for another placement"
done
echo passed
