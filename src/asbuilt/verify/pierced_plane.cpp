// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/pierced_plane.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/random.h"

namespace asbuilt::verify {
namespace {

constexpr double kMargin = 0.02;     // of the diameter: what lies so near a plane touches it
constexpr double kTouching = 0.15;   // of what lies near it, that has the plane beside it
constexpr double kAcross = 0.8;      // cosine: faces along the plane do not meet it
constexpr double kAlike = 0.95;      // cosine of normals of one plane
constexpr double kAround = 0.75;     // of the diameter, from the middle of the part: beside it, too
constexpr double kLeastArea = 0.03;  // of a plane, in squares of the diameter
constexpr std::size_t kFewest = 50;  // points of a plane
constexpr int kMostPlanes = 4;
constexpr int kDraws = 32;
constexpr std::size_t kAsked = 1000;    // points by which a draw is judged
constexpr std::size_t kSamples = 3000;  // of the model

struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float offset = 0.0F;

  [[nodiscard]] float height(const Eigen::Vector3f& point) const { return normal.dot(point) - offset; }
};

struct Oriented {
  Eigen::Vector3f point, normal;
};

bool lies_on(const Plane& plane, const Oriented& measured, float margin) {
  return std::abs(plane.height(measured.point)) <= margin &&
         std::abs(plane.normal.dot(measured.normal)) >= static_cast<float>(kAlike);
}

// The plane with most of the points, by a fixed draw.
Plane strongest_plane(const std::vector<Oriented>& points, float margin) {
  Random random(0, "planes about a part", points.size());
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kAsked);
  Plane best;
  std::size_t most = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Oriented& drawn = points[random.below(points.size())];
    const Plane plane{drawn.normal, drawn.normal.dot(drawn.point)};
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); i += stride) count += lies_on(plane, points[i], margin) ? 1 : 0;
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  return best;
}

// A single normal is tilted by noise; the plane of all of them is not.
Plane fitted_again(const Plane& plane, const std::vector<Oriented>& points, float margin) {
  std::vector<Eigen::Vector3d> on_it;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Oriented& measured : points) {
    if (lies_on(plane, measured, margin)) on_it.push_back(measured.point.cast<double>()), centre += on_it.back();
  }
  if (on_it.size() < kFewest) return plane;
  centre /= static_cast<double>(on_it.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : on_it) scatter += (point - centre) * (point - centre).transpose();
  const SymmetricEigen<3> solver(scatter);
  const Eigen::Vector3f normal = solver.eigenvectors().col(0).cast<float>();
  return {normal, normal.dot(centre.cast<float>())};
}

double pierced_by(const Plane& plane, const std::vector<Eigen::Vector3f>& on_it, const Pose& scan_from_model,
                  const model::PreparedModel& model, float margin, float reach) {
  const KdTree tree(on_it);
  const Eigen::Matrix3f rotation = scan_from_model.linear().cast<float>();
  const Eigen::Vector3f translation = scan_from_model.translation().cast<float>();
  const std::size_t count = std::min(kSamples, model.dense_samples.size());
  std::size_t above = 0, below = 0, near = 0, touching = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f point = rotation * model.dense_samples.positions[i] + translation;
    const float height = plane.height(point);
    above += height > margin ? 1 : 0;
    below += height < -margin ? 1 : 0;
    const float along = plane.normal.dot(rotation * model.dense_samples.normals[i]);
    if (std::abs(height) > margin || std::abs(along) > static_cast<float>(kAcross)) continue;
    ++near;
    touching += tree.nearest(point, reach).found() ? 1 : 0;
  }
  if (static_cast<double>(touching) < kTouching * static_cast<double>(near) || near == 0) return 0.0;
  return static_cast<double>(std::min(above, below)) / static_cast<double>(count);
}

// What was measured in the part's sphere and is not its own.
std::vector<Oriented> points_around(const scan::Scan& scan, const Pose& model_from_scan,
                                    const model::PreparedModel& model, const Eigen::Vector3f& centre, float reach,
                                    double distance_mm) {
  const float radius = static_cast<float>(kAround * model.diameter) + reach;
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const Eigen::Vector3f translation = model_from_scan.translation().cast<float>();
  std::vector<Oriented> around;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    const Eigen::Vector3f& point = scan.cloud.positions[i];
    if ((point - centre).squaredNorm() > radius * radius) continue;
    if (std::abs(model.field->distance_at(rotation * point + translation)) <= static_cast<float>(distance_mm)) continue;
    around.push_back({point, scan.cloud.normals[i]});
  }
  return around;
}

}  // namespace

double pierced_share(const Pose& model_from_scan, const model::PreparedModel& model, const scan::Scan& scan,
                     double distance_mm) {
  const auto margin = static_cast<float>(std::max(kMargin * model.diameter, 2.0 * distance_mm));
  const auto reach = margin + static_cast<float>(2.5 * scan.spacing_mm);
  const Pose scan_from_model = model_from_scan.inverse();
  const Eigen::Vector3f centre = (scan_from_model * model.box.center().eval()).cast<float>();
  const double spacing_mm = scan.spacing_at(centre.cast<double>());
  const auto fewest = std::max(
      kFewest, static_cast<std::size_t>(kLeastArea * std::pow(model.diameter / std::max(spacing_mm, 1e-9), 2)));
  std::vector<Oriented> around = points_around(scan, model_from_scan, model, centre, reach, distance_mm);
  double most = 0.0;
  for (int found = 0; found < kMostPlanes && around.size() >= fewest; ++found) {
    const Plane plane = fitted_again(strongest_plane(around, margin), around, margin);
    std::vector<Eigen::Vector3f> on_it;
    for (const Oriented& measured : around) {
      if (lies_on(plane, measured, margin)) on_it.push_back(measured.point);
    }
    if (on_it.size() < fewest) break;
    most = std::max(most, pierced_by(plane, on_it, scan_from_model, model, margin, reach));
    std::erase_if(around, [&](const Oriented& measured) { return std::abs(plane.height(measured.point)) <= margin; });
  }
  return most;
}

}  // namespace asbuilt::verify
