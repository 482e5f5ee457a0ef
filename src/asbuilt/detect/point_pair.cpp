// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/point_pair.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asbuilt::detect {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

float angle_of(float cosine) { return std::acos(std::clamp(cosine, -1.0F, 1.0F)); }

// A feature in units of bins.
std::array<float, 4> in_bins(const PointPairFeature& f, const Quantisation& q) {
  const float per_angle = static_cast<float>(q.angle_bins) / kPi;
  return {f.distance / q.distance_step, f.angle_i_d * per_angle, f.angle_j_d * per_angle, f.angle_i_j * per_angle};
}

std::array<int, 4> sizes(const Quantisation& q) { return {q.distance_bins, q.angle_bins, q.angle_bins, q.angle_bins}; }

std::uint32_t flat(const std::array<int, 4>& index, const Quantisation& q) {
  return static_cast<std::uint32_t>(((index[0] * q.angle_bins + index[1]) * q.angle_bins + index[2]) * q.angle_bins +
                                    index[3]);
}

}  // namespace

PointPairFeature point_pair_feature(const Eigen::Vector3f& point_i, const Eigen::Vector3f& normal_i,
                                    const Eigen::Vector3f& point_j, const Eigen::Vector3f& normal_j) {
  const Eigen::Vector3f d = point_i - point_j;
  const float length = d.norm();
  const Eigen::Vector3f direction = d / length;
  return {length, angle_of(normal_i.dot(direction)), angle_of(normal_j.dot(direction)),
          angle_of(normal_i.dot(normal_j))};
}

Pose local_frame(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  Pose frame = Pose::Identity();
  frame.linear() =
      Eigen::Quaterniond::FromTwoVectors(normal.cast<double>(), Eigen::Vector3d::UnitX()).toRotationMatrix();
  frame.translation() = -(frame.linear() * point.cast<double>());
  return frame;
}

float angle_in_frame(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& offset_from_reference) {
  return std::atan2(rotation.row(2).dot(offset_from_reference), rotation.row(1).dot(offset_from_reference));
}

Pose model_from_scan_of(const Pose& model_frame, const Pose& scene_frame, double alpha) {
  return model_frame.inverse() * Eigen::AngleAxisd(-alpha, Eigen::Vector3d::UnitX()) * scene_frame;
}

std::uint32_t Quantisation::bin(const PointPairFeature& feature) const {
  const std::array<float, 4> value = in_bins(feature, *this);
  if (!(value[0] < static_cast<float>(distance_bins))) return kNoBin;
  std::array<int, 4> index;
  for (std::size_t i = 0; i < 4; ++i) index[i] = std::min(static_cast<int>(value[i]), sizes(*this)[i] - 1);
  return flat(index, *this);
}

Quantisation::Bins Quantisation::soft_bins(const PointPairFeature& feature, int wanted, float reach) const {
  Bins result;
  const std::array<float, 4> value = in_bins(feature, *this);
  const std::array<int, 4> size = sizes(*this);
  std::array<int, 4> own, beside;
  std::array<float, 4> cost;  // distance to the border that must be crossed
  for (std::size_t i = 0; i < 4; ++i) {
    // A distance just past the last bin may still have come from it.
    own[i] = std::clamp(static_cast<int>(value[i]), 0, i == 0 ? size[i] : size[i] - 1);
    const float share = value[i] - static_cast<float>(own[i]);
    beside[i] = share < 0.5F ? own[i] - 1 : own[i] + 1;
    cost[i] = share < 0.5F ? share : 1.0F - share;
  }
  struct Choice {
    float cost;
    int crossings;
  };
  std::array<Choice, kMostNeighbours> choices;
  int count = 0;
  for (int crossings = 0; crossings < kMostNeighbours; ++crossings) {
    float total = 0.0F;
    bool exists = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const bool crosses = ((crossings >> i) & 1) != 0;
      const int index = crosses ? beside[i] : own[i];
      exists = exists && index >= 0 && index < size[i] && (!crosses || cost[i] < reach);
      total += crosses ? cost[i] : 0.0F;
    }
    if (!exists) continue;
    // Insertion keeps the cheapest first; equal costs keep the order of the crossings.
    int place = count++;
    for (; place > 0 && choices[static_cast<std::size_t>(place - 1)].cost > total; --place) {
      choices[static_cast<std::size_t>(place)] = choices[static_cast<std::size_t>(place - 1)];
    }
    choices[static_cast<std::size_t>(place)] = {total, crossings};
  }
  result.count = std::min(count, wanted);
  for (int k = 0; k < result.count; ++k) {
    std::array<int, 4> index;
    for (std::size_t i = 0; i < 4; ++i) {
      index[i] = ((choices[static_cast<std::size_t>(k)].crossings >> i) & 1) != 0 ? beside[i] : own[i];
    }
    result.bin[static_cast<std::size_t>(k)] = flat(index, *this);
  }
  return result;
}

}  // namespace asbuilt::detect
