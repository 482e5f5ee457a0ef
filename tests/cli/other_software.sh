# SPDX-License-Identifier: Apache-2.0
# What we write others read, and what they write we read: CloudCompare, the tools of PCL and Open3D (python3-open3d),
# each where it is installed. LAS is not among it: we write none, and Debian's CloudCompare neither reads nor writes it.
. "$(dirname "$0")/common.sh"
cloudcompare=$(command -v CloudCompare || command -v cloudcompare.CloudCompare || true)
pcd2ply=$(command -v pcl_pcd2ply || true)
ply2pcd=$(command -v pcl_ply2pcd || true)
open3d=
for python in python3 /usr/bin/python3; do
  [ -n "$open3d" ] || ! "$python" -c 'import open3d' >open3d.log 2>&1 || open3d=$python
done
[ -n "$cloudcompare$pcd2ply$ply2pcd$open3d" ] ||
  { echo "neither CloudCompare nor the tools of PCL nor Open3D are here"; exit 77; }
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

triangles_of() {
  expect 0 info "$1" --json
  count_of triangles
}

# With what others need not know: support, sigma, deviation and its colours beside positions and normals.
expect 0 simulate demo:valve_body -o scene --scans 3 --points 12000 --seed 5
expect 0 reconstruct scene/model.ply scene/scan_00.ply scene/scan_01.ply scene/scan_02.ply -o result
cp result/reconstruction.ply own.ply
described own.ply
own_count=$count own_extent=$extent
expect 0 prepare scene/model.ply -o scene/model.asbuilt --skin mesh.ply
own_triangles=$(triangles_of mesh.ply)

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
  for kind in PLY STL OBJ; do
    "$cloudcompare" -SILENT -AUTO_SAVE OFF -NO_TIMESTAMP -M_EXPORT_FMT $kind -O mesh.ply \
      -SAVE_MESHES FILE theirs_mesh.$kind >cc.log 2>&1 || fail "CloudCompare refuses our mesh: $(tail -n 3 cc.log)"
    [ "$(triangles_of theirs_mesh.$kind)" = "$own_triangles" ] || fail "CloudCompare's $kind has other triangles"
  done
fi
if [ -n "$open3d" ]; then
  # It tells what it read, and writes what it can write.
  "$open3d" - >open3d.log 2>&1 <<'EOF' || fail "Open3D refuses our PLY: $(tail -n 3 open3d.log)"
import open3d
cloud = open3d.io.read_point_cloud("own.ply")
assert cloud.has_normals() and cloud.has_colors()
for name, how in [("ascii.ply", {"write_ascii": True}), ("binary.ply", {}), ("ascii.pcd", {"write_ascii": True}),
                  ("binary.pcd", {}), ("compressed.pcd", {"compressed": True}), ("text.xyz", {}), ("text.pts", {})]:
    assert open3d.io.write_point_cloud("open3d_" + name, cloud, **how), name
mesh = open3d.io.read_triangle_mesh("mesh.ply")
mesh.compute_triangle_normals()
for kind in ["ply", "stl", "obj", "off"]:
    assert open3d.io.write_triangle_mesh("open3d_mesh." + kind, mesh), kind
EOF
  for name in ascii.ply binary.ply ascii.pcd binary.pcd compressed.pcd text.xyz text.pts; do
    same_as open3d_$name
  done
  for kind in ply stl obj off; do
    [ "$(triangles_of open3d_mesh.$kind)" = "$own_triangles" ] || fail "Open3D's $kind has other triangles"
  done
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
