// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/rim_points.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "asbuilt/core/parallel.h"

namespace asbuilt::refine {
namespace {

// In spacings.
constexpr float kHalfWidth = 4.0F;                    // of the window along the rim
constexpr float kDepth = 5.5F;                        // of the window, from the point into the face
constexpr float kFullDepth = 2.0F;                    // from here to the rim every sample counts fully
constexpr float kLeastEnd = -0.5F, kMostEnd = 1.75F;  // where a face may end, as seen from one of its last samples
constexpr float kLimitInSigmas = 4.0F;                // neighbours further off the plane are of another face
constexpr float kFlat = 0.9F;                         // cosine: normals of one flat face
constexpr float kStraight = 0.15F;                    // variance across a straight rim / variance along it
constexpr float kLeastOnFace = 0.8F;  // share of the neighbours on the side of the face that must be on it
constexpr int kLeastCount = 12;

float squared(float x) { return x * x; }

float window(float u) { return squared(std::max(0.0F, 1.0F - u * u)); }  // its integral is 16 / 15

// The integral of window() from -1 to u, divided by the whole: a smooth step from 0 to 1.
float step(float u) {
  const float t = std::clamp(u, -1.0F, 1.0F);
  return 0.5F + 15.0F / 16.0F * (t - 2.0F / 3.0F * t * t * t + t * t * t * t * t / 5.0F);
}

struct End {
  Eigen::Vector3f position, outward;
};

class RimReader {
 public:
  RimReader(const PointCloud& cloud, const KdTree& tree, const std::vector<char>& at_rim, double spacing_mm,
            double noise_sigma_mm)
      : cloud_(cloud),
        tree_(tree),
        at_rim_(at_rim),
        spacing_(static_cast<float>(spacing_mm)),
        limit_(kLimitInSigmas * static_cast<float>(std::max(noise_sigma_mm, 1e-3 * spacing_mm))) {}

  std::optional<End> end_at(std::uint32_t i) {
    const Eigen::Vector3f& centre = cloud_.positions[i];
    const Eigen::Vector3f& normal = cloud_.normals[i];
    tree_.within(centre, 1.02F * std::hypot(kHalfWidth, kDepth) * spacing_, neighbours_);
    on_face_.clear();
    Eigen::Vector3f inwards = Eigen::Vector3f::Zero();
    Eigen::Matrix3f along = Eigen::Matrix3f::Zero();
    int off_face = 0;
    for (const KdTree::Neighbour& neighbour : neighbours_) {
      const Eigen::Vector3f offset = cloud_.positions[neighbour.index] - centre;
      if (cloud_.normals[neighbour.index].dot(normal) < kFlat || std::abs(normal.dot(offset)) > limit_) {
        off_face += std::abs(normal.dot(offset)) < limit_ ? 1 : 0;
        continue;
      }
      const Eigen::Vector3f flat = offset - normal * normal.dot(offset);
      on_face_.push_back(flat);
      inwards += flat;
      if (at_rim_[neighbour.index] != 0 && offset.norm() < kHalfWidth * spacing_) along += flat * flat.transpose();
    }
    const auto count = static_cast<float>(on_face_.size());
    if (count < kLeastCount || count < kLeastOnFace * (count + static_cast<float>(off_face))) return {};
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen(along);
    if (!(eigen.eigenvalues()[1] < kStraight * eigen.eigenvalues()[2])) return {};
    const Eigen::Vector3f tangent = eigen.eigenvectors().col(2);
    Eigen::Vector3f outward = tangent.cross(normal);
    if (!(outward.norm() > 0.9F)) return {};
    outward.normalize();
    if (outward.dot(inwards) > 0.0F) outward = -outward;
    const std::optional<float> end = end_along(tangent, outward);
    if (!end) return {};
    return End{centre + *end * outward, outward};
  }

 private:
  // How far the face goes: what a window holds, over what a metre of it holds.
  [[nodiscard]] std::optional<float> end_along(const Eigen::Vector3f& tangent, const Eigen::Vector3f& outward) const {
    const float middle = -0.5F * (kFullDepth + kDepth) * spacing_, half = 0.5F * (kDepth - kFullDepth) * spacing_;
    float held = 0.0F, density = 0.0F;
    for (const Eigen::Vector3f& flat : on_face_) {
      const float across = window(flat.dot(tangent) / (kHalfWidth * spacing_));
      const float u = (flat.dot(outward) - middle) / half;
      held += across * step(u);
      density += across * window(u);
    }
    density /= 16.0F / 15.0F * half;
    if (!(density * spacing_ > 1.0F)) return {};  // of a window over a full face: 4.3 on a square grid
    const float end = middle + held / density;
    if (end < kLeastEnd * spacing_ || end > kMostEnd * spacing_) return {};
    return end;
  }

  const PointCloud& cloud_;
  const KdTree& tree_;
  const std::vector<char>& at_rim_;
  float spacing_, limit_;
  std::vector<KdTree::Neighbour> neighbours_;
  std::vector<Eigen::Vector3f> on_face_;
};

}  // namespace

RimPoints rim_points(const PointCloud& cloud, const KdTree& tree, std::span<const std::uint32_t> rim, double spacing_mm,
                     double noise_sigma_mm, const Context& context) {
  RimPoints result;
  if (!(spacing_mm > 0.0)) return result;
  std::vector<char> at_rim(cloud.size(), 0);
  for (const std::uint32_t i : rim) at_rim[i] = 1;
  std::vector<std::optional<End>> ends(rim.size());
  parallel_for_blocks(context, rim.size(), 64, [&](std::size_t begin, std::size_t end) {
    RimReader reader(cloud, tree, at_rim, spacing_mm, noise_sigma_mm);
    for (std::size_t i = begin; i < end; ++i) ends[i] = reader.end_at(rim[i]);
  });
  for (std::size_t i = 0; i < rim.size(); ++i) {
    if (!ends[i]) continue;
    result.ends.positions.push_back(ends[i]->position);
    result.ends.normals.push_back(ends[i]->outward);
    result.face_normals.push_back(cloud.normals[rim[i]]);
  }
  return result;
}

}  // namespace asbuilt::refine
