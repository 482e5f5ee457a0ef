// SPDX-License-Identifier: Apache-2.0
// A program of a stranger's: it prepares a block, writes it, reads it back and inspects a cloud against it.
#include <asbuilt/core/context.h>
#include <asbuilt/core/triangle_mesh.h>
#include <asbuilt/inspect/deviation.h>
#include <asbuilt/io/mesh_file.h>
#include <asbuilt/model/prepared_model.h>

#include <array>
#include <cmath>
#include <cstdio>

namespace {

// 20 x 30 x 60 mm: the diagonal is 70.
asbuilt::TriangleMesh block() {
  asbuilt::TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices.emplace_back(corner & 1 ? 20.0 : 0.0, corner & 2 ? 30.0 : 0.0, corner & 4 ? 60.0 : 0.0);
  }
  const std::array<std::array<int, 4>, 6> faces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& face : faces) {
    mesh.triangles.emplace_back(face[0], face[1], face[2]);
    mesh.triangles.emplace_back(face[0], face[2], face[3]);
  }
  return mesh;
}

int complain(const asbuilt::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const asbuilt::Context context(2);
  if (auto written = asbuilt::io::write_mesh_ply(argv[1], block()); !written) return complain(written.error());
  const auto mesh = asbuilt::io::read_mesh(argv[1], asbuilt::io::Unit::millimetre);
  if (!mesh) return complain(mesh.error());
  const auto model = asbuilt::model::prepare(*mesh, {}, context);
  if (!model) return complain(model.error());

  asbuilt::PointCloud cloud;
  cloud.positions = {{10.0F, 15.0F, 61.0F}, {21.0F, 15.0F, 30.0F}, {10.0F, 31.0F, 30.0F}};
  cloud.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  const auto report = asbuilt::inspect::inspect(cloud, *model, {}, context);
  if (!report) return complain(report.error());
  for (const float deviation : report->deviation_mm) {
    if (std::abs(deviation - 1.0F) > 1e-3F) return complain({{}, "a point 1 mm outside does not deviate by 1 mm"});
  }
  std::printf("a block of diameter %.3f mm\n", model->diameter);
  return 0;
}
