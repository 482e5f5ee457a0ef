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
