// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/point_pair.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/matrix_factors.h"

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
  frame.linear() = rotation_between(normal.cast<double>(), Eigen::Vector3d::UnitX()).toRotationMatrix();
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
  const std::array<float, 4> value = in_bins(feature, *this);
  const std::array<int, 4> size = sizes(*this);
  const int layer = angle_bins * angle_bins;
  const std::array<int, 4> stride{layer * angle_bins, layer, angle_bins, 1};
  // All subsets of the borders that may be crossed, in the order of their bits. The bins are cheapest first; equal
  // costs keep that order.
  std::array<float, kMostNeighbours> total;  // distance to the borders that must be crossed
  std::array<int, kMostNeighbours> step;     // from the own bin
  total[0] = 0.0F;
  step[0] = 0;
  std::size_t subsets = 1;
  int own_bin = 0;
  bool is_past_end = false;
  for (std::size_t i = 0; i < 4; ++i) {
    // A distance just past the last bin may still have come from it.
    const int own = std::clamp(static_cast<int>(value[i]), 0, i == 0 ? size[i] : size[i] - 1);
    const float share = value[i] - static_cast<float>(own);
    const int direction = share < 0.5F ? -1 : 1;
    const float cost = share < 0.5F ? share : 1.0F - share;
    own_bin += own * stride[i];
    const bool may_cross = cost < reach && own + direction >= 0 && own + direction < size[i];
    if (own == size[i]) {
      is_past_end = true;
      if (!may_cross) return {};
    }
    if (!may_cross) continue;
    for (std::size_t k = 0; k < subsets; ++k) {
      total[subsets + k] = total[k] + cost;
      step[subsets + k] = step[k] + direction * stride[i];
    }
    subsets *= 2;
  }
  Bins result;
  std::array<float, kMostNeighbours> kept;
  // Past the end, the border of the distance is the lowest bit and has to be crossed.
  for (std::size_t k = is_past_end ? 1 : 0; k < subsets; k += is_past_end ? 2 : 1) {
    if (result.count == wanted && !(total[k] < kept[static_cast<std::size_t>(wanted - 1)])) continue;
    auto place = static_cast<std::size_t>(result.count < wanted ? result.count++ : wanted - 1);
    for (; place > 0 && kept[place - 1] > total[k]; --place) {
      kept[place] = kept[place - 1];
      result.bin[place] = result.bin[place - 1];
    }
    kept[place] = total[k];
    result.bin[place] = static_cast<std::uint32_t>(own_bin + step[k]);
  }
  return result;
}

}  // namespace asbuilt::detect
