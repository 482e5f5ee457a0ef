# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"
data=$(cd "$(dirname "$0")/../../.." && pwd)/shared/data

# one FILE POINTS SCANS: info tells so many points in so many scans.
one() {
  expect 0 info "$1" --json
  [ "$(count_of points)" = "$2" ] || fail "$1: $(count_of points) points, expected $2"
  [ "$(grep -c '"has_pose":' stdout)" = "$3" ] || fail "$1: $(grep -c '"has_pose":' stdout) scans, expected $3"
}

# ---- files of our own making
printf '1\n2\n5 6 7\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 6 7 1\n1 2 3 0.5\n0 0 0 0.5\n' >one.ptx
cat one.ptx one.ptx >hall.ptx
one hall.ptx 2 2
grep -q 'scan-unit m' stdout || fail "nothing says that PTX is mostly in metres"
printf '1,2,3,9\n4,5,6,9\n' | gzip >scan.csv.gz
one scan.csv.gz 2 1
expect 0 info scan.csv.gz --columns z,y,x,i --json
grep -q '"has_intensities": true' stdout || fail "--columns was not followed"
printf 'LASF' >short.las
expect 3 info short.las
says short.las truncated
# A size that nothing has is told, and how to say the unit; what states its unit, or is said, is not doubted.
printf '0 0 1\n0.2 0 1\n0 0.1 1\n' >metres.xyz
expect 0 info metres.xyz
grep -q 'unit mm (not stated)' stdout || fail "nothing says that the unit was guessed"
grep -q 'scan-unit m ' stdout || fail "a scan of 0.2 mm is not doubted"
expect 0 info metres.xyz --unit m
! grep -q 'not stated)\|scan-unit' stdout || fail "a unit that was said is doubted"
# Matrices that lie beside scans are no scans of three or four points.
printf '0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n' >pose.txt
expect 0 info pose.txt
grep -q 'pose, 4 x 4 matrix' stdout || fail "a pose is not told"
grep -q 'turns by 90 degrees and then shifts by 5, 6, 7' stdout || fail "a pose is told wrongly"
printf '0 -2 0 5\n2 0 0 6\n0 0 2 7\n0 0 0 1\n' >scaled.xf
expect 0 info scaled.xf
grep -q 'no rigid motion' stdout || fail "a matrix with a scale is taken for a motion"
printf '500 0 320\n0 510 240\n0 0 1\n' >intrinsic.txt
expect 0 info intrinsic.txt
grep -q 'fx 500, fy 510, cx 320, cy 240' stdout || fail "a camera is not told"
printf '1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 2\n' >points.txt
one points.txt 3 1  # the fourth lies at the origin, as a no-return does

# ---- files of other software, where they are
if [ -d "$data/formats" ]; then
  one "$data/formats/bunnyDouble.e57" 30571 1
  one "$data/formats/bunnyInt21.e57" 30571 1
  one "$data/formats/A_moved_B.e57" 6 2  # its header counts 2 and 4
  one "$data/formats/ZeroPoints.e57" 0 1
  one "$data/formats/simple.las" 1065 1
  one "$data/formats/no-points.las" 0 1
  expect 3 info "$data/formats/bad-crc.e57"
  says 'page 0 is damaged'
  expect 0 info "$data/pcl_milk/milk.pcd"
  grep -q 'scan-unit m ' stdout || fail "a carton of 0.3 mm is not doubted"
  expect 0 info "$data/sim/clamp_absent/truth.json"
  grep -q '10 scans, of which 5 show the part' stdout || fail "truth.json is not told"
fi
if [ -d "$data/cad" ]; then
  if "$asbuilt" info "$data/cad/frame.step" --json >stdout 2>stderr; then
    grep -q '"kind": "cad"' stdout || fail "a STEP file is no CAD file"
    grep -q '"unit": "inch"' stdout || fail "the unit of the STEP file is not told"
    # As large as the mesh that another program made of it.
    grep -A4 '"extent"' stdout | tr -d ' \n' | grep -q '\[711\.[0-9]*,292\.[0-9]*,81[23]\.' || fail "the STEP file has another size"
  else
    says OpenCASCADE # a build without it says so
  fi
  one "$data/tum_bunny/depth/depth_00.png" 16728 1
fi
echo passed
