# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"
small_scene
model=scene/model.ply
good=scene/scan_00.ply

# ---- models: nothing can be done, so nothing is left behind
printf 'solid x\nendsolid x\n' >empty.stl
: >zero_bytes.stl
head -c 2000 "$model" >truncated.ply
printf 'solid flat\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 1\nvertex 2 2 2\nendloop\nendfacet\nendsolid flat\n' >no_area.stl
printf 'this is no mesh\n' >words.stl
for bad in missing.stl empty.stl zero_bytes.stl truncated.ply no_area.stl words.stl .; do
  expect 3 reconstruct "$bad" "$good" -o out
  absent out
  expect 3 prepare "$bad" -o out.asbuilt
  absent out.asbuilt
done
expect 3 reconstruct missing.stl "$good" -o out
says missing.stl

# ---- scans: each fails on its own, with its reason
: >zero_bytes.ply
head -c 3000 "$good" >cut.ply
printf 'not a scan at all\n' >words.xyz
printf 'nan nan nan\nnan nan nan\nnan nan nan\nnan nan nan\n' >nan.xyz
printf '1 2 3\n' >one.xyz
bad_scans="missing.ply zero_bytes.ply cut.ply words.xyz nan.xyz one.xyz"
# shellcheck disable=SC2086
expect 3 reconstruct "$model" $bad_scans -o all_bad
for name in missing zero_bytes cut words nan one; do
  [ "$(status_of all_bad $name)" = failed ] || fail "$name is '$(status_of all_bad $name)', expected failed"
  [ "$(field_of all_bad $name reason_code)" = unreadable ] || fail "$name has no reason_code unreadable"
done
grep -q '"state": "failed"' all_bad/result.json || fail "the state is not failed"
absent all_bad/reconstruction.ply

# ---- one bad scan never stops the others
# shellcheck disable=SC2086
expect 0 detect "$model" missing.ply "$good" cut.ply -o mixed
says warning missing.ply cut.ply
[ "$(status_of mixed scan_00)" = accepted ] || fail "the good scan is $(status_of mixed scan_00)"

# ---- readable, but the part cannot be in it
awk 'BEGIN { for (i = 0; i < 100; ++i) for (j = 0; j < 100; ++j) print i * 5, j * 5, 800 }' >plane.xyz
expect 1 detect "$model" plane.xyz -o plane
[ "$(status_of plane plane)" = rejected ] || fail "a plane was not rejected"
expect 0 explain plane
grep -q "plane .* is rejected \[$(field_of plane plane reason_code)\]" stdout || fail "explain does not say why"

# ---- a unit that is wrong by 1000 is named
expect 1 detect "$model" "$good" -o metres --unit m
[ "$(field_of metres scan_00 reason_code)" = scan_too_small ] || fail "scan_too_small expected"
grep -q -- '--scan-unit m\|--unit mm' metres/result.json || fail "the flag that helps is not named"
expect 1 detect "$model" "$good" -o large --scan-unit m
grep -q '"reason_code": "scan_too_small"\|"reason_code": "wrong_unit"' large/result.json || fail "no reason for a wrong unit"

# ---- info
expect 3 info missing.ply "$good" --json
grep -q '"error"' stdout || fail "info --json does not tell the error"
grep -q '"kind": "scan"' stdout || fail "info --json lost the good file"
expect 3 explain missing_folder
expect 3 evaluate missing.json all_bad
expect 3 register missing_folder -o registered
absent registered
echo passed
