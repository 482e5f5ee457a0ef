// SPDX-License-Identifier: Apache-2.0
// Writes one large scan of a known scene, row by row, so that memory does not grow with it:
//   asbuilt_big_generate POINTS FOLDER
// FOLDER gets model.ply, scan.ply (binary, x y z intensity as float: 16 bytes a point) and pose.txt, the true
// model_from_scan. The part is a valve body on a floor among boxes; noise is Gaussian along the ray, sigma in pose.txt.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/simulate/parts.h"

namespace {

using namespace asbuilt;

constexpr double kSigma_mm = 0.1;

TriangleMesh moved(TriangleMesh mesh, const Pose& pose) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = pose * vertex;
  return mesh;
}

Pose placed(double x, double y, double z, double turn) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  pose.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

/// The sensor looks along its z axis, y down, from above the scene.
Pose scene_from_scan(const Eigen::Vector3d& sensor, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - sensor).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Pose pose = Pose::Identity();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = sensor;
  return pose;
}

struct Point {
  float x, y, z, intensity;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: asbuilt_big_generate POINTS FOLDER\n", stderr), 2;
  const auto side = static_cast<std::size_t>(std::llround(std::sqrt(std::atof(argv[1]))));
  const std::filesystem::path folder = argv[2];
  std::filesystem::create_directories(folder);
  const TriangleMesh part = simulate::valve_body();
  if (side < 100 || !io::write_mesh_ply(folder / "model.ply", part)) return 1;

  double lowest = 1e30;
  for (const Eigen::Vector3d& vertex : part.vertices) lowest = std::min(lowest, vertex.z());
  const Pose scene_from_model = placed(30, -20, -lowest, 0.7);
  // Boxes and cylinders are centred: these stand on the floor, whose upper side is at 0.
  const std::vector<TriangleMesh> scene{moved(part, scene_from_model),
                                        moved(simulate::box({12000, 12000, 10}), placed(0, 0, -5, 0)),
                                        moved(simulate::box({150, 90, 200}), placed(260, 120, 100, 0.4)),
                                        moved(simulate::box({80, 220, 60}), placed(-330, 60, 30, -0.3)),
                                        moved(simulate::cylinder(60, 180), placed(60, 330, 90, 0))};
  const model::RayScene rays{std::span<const TriangleMesh>(scene)};
  const Pose from_scan = scene_from_scan({-500, -800, 700}, {0, 0, 60});
  const Context context;

  std::FILE* const file = std::fopen((folder / "scan.ply").c_str(), "wb");
  if (file == nullptr) return std::perror("scan.ply"), 1;
  fmt::print(
      file,
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
      "z\nproperty float intensity\nend_header\n",
      side * side);
  std::vector<Point> row(side);
  constexpr double kHalfView = 0.4;  // tangent; every ray meets the floor at least
  for (std::size_t r = 0; r < side; ++r) {
    parallel_for_blocks(context, side, 512, [&](std::size_t begin, std::size_t end) {
      Random random(1, "row", r * side + begin);
      for (std::size_t c = begin; c < end; ++c) {
        const auto across = [&](std::size_t i) {
          return kHalfView * (2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(side) - 1.0);
        };
        const Eigen::Vector3d direction = Eigen::Vector3d(across(c), across(r), 1.0).normalized();
        const auto hit = rays.first_hit(from_scan.translation(), from_scan.linear() * direction);
        const Eigen::Vector3d point = hit.found()
                                          ? Eigen::Vector3d((hit.distance + kSigma_mm * random.normal()) * direction)
                                          : Eigen::Vector3d::Zero();
        row[c] = {static_cast<float>(point.x()), static_cast<float>(point.y()), static_cast<float>(point.z()),
                  static_cast<float>(hit.mesh)};
      }
    });
    if (std::fwrite(row.data(), sizeof(Point), side, file) != side) return std::perror("scan.ply"), 1;
  }
  if (std::fclose(file) != 0) return std::perror("scan.ply"), 1;
  const Pose truth = scene_from_model.inverse() * from_scan;
  std::ofstream pose(folder / "pose.txt");
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) pose << fmt::format("{:.17g}{}", truth.matrix()(i, j), j == 3 ? '\n' : ' ');
  }
  pose << fmt::format("sigma_mm {}\n", kSigma_mm);
  return pose.good() ? 0 : 1;
}
