# SPDX-License-Identifier: Apache-2.0
# What we write others read, and what they write we read: CloudCompare and the tools of PCL, each where it is installed.
. "$(dirname "$0")/common.sh"
cloudcompare=$(command -v CloudCompare || command -v cloudcompare.CloudCompare || true)
pcd2ply=$(command -v pcl_pcd2ply || true)
ply2pcd=$(command -v pcl_ply2pcd || true)
[ -n "$cloudcompare$pcd2ply$ply2pcd" ] || { echo "neither CloudCompare nor the tools of PCL are here"; exit 77; }
export QT_QPA_PLATFORM=offscreen HOME="$here" LC_ALL=C

# described FILE: number of points and extent as we read them.
described() {
  expect 0 info "$1" --json
  count=$(count_of points)
  extent=$(tr -d ' \n' <stdout | sed 's/.*"extent":\[\([^]]*\)\].*/\1/')
}

# same_as FILE: holds what the scan of our own holds, to a micrometre of extent.
same_as() {
  [ -f "$1" ] || fail "$1 was not written"
  described "$1"
  [ "$count" = "$own_count" ] || fail "$1: $count points, expected $own_count"
  echo "$extent,$own_extent" | awk -F, '{ for (i = 1; i <= 3; ++i) if (($i - $(i + 3))^2 > 1e-4) exit 1 }' ||
    fail "$1: extent $extent, expected $own_extent"
}

expect 0 simulate demo:valve_body -o scene --scans 1 --points 5000 --seed 5
cp scene/scan_00.ply own.ply
described own.ply
own_count=$count own_extent=$extent

if [ -n "$cloudcompare" ]; then
  # Ours in, theirs out: PLY in both kinds, text, PCD where their build has it.
  for kind in BINARY_LE ASCII; do
    "$cloudcompare" -SILENT -AUTO_SAVE OFF -NO_TIMESTAMP -C_EXPORT_FMT PLY -PLY_EXPORT_FMT $kind -O own.ply \
      -SAVE_CLOUDS FILE theirs_$kind.ply >cc.log 2>&1 || fail "CloudCompare refuses our PLY: $(tail -n 3 cc.log)"
    same_as theirs_$kind.ply
  done
  "$cloudcompare" -SILENT -AUTO_SAVE OFF -NO_TIMESTAMP -C_EXPORT_FMT ASC -PREC 6 -O own.ply \
    -SAVE_CLOUDS FILE theirs.asc >cc.log 2>&1 || fail "CloudCompare refuses our PLY: $(tail -n 3 cc.log)"
  same_as theirs.asc
fi
if [ -n "$ply2pcd" ] && [ -n "$pcd2ply" ]; then
  "$ply2pcd" own.ply theirs.pcd >pcl.log 2>&1 || fail "PCL refuses our PLY: $(tail -n 3 pcl.log)"
  same_as theirs.pcd
  "$pcd2ply" theirs.pcd back.ply >pcl.log 2>&1 || fail "PCL cannot convert back: $(tail -n 3 pcl.log)"
  same_as back.ply
fi
if [ -n "$(command -v pcl_convert_pcd_ascii_binary)" ] && [ -f theirs.pcd ]; then
  for kind in 0 1 2; do # ascii, binary, compressed
    pcl_convert_pcd_ascii_binary theirs.pcd kind_$kind.pcd $kind >pcl.log 2>&1 || fail "PCL: $(tail -n 3 pcl.log)"
    same_as kind_$kind.pcd
  done
fi
echo passed
