// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/sanitise.h"

#include <algorithm>
#include <array>
#include <bit>

#include "asbuilt/core/parallel.h"

namespace asbuilt::scan {
namespace {

// Points by a number that equal ones share: sorting integers takes half the time of sorting triples.
struct Keyed {
  std::uint64_t hash;
  std::uint32_t index;
};

// Adding 0 turns -0 into +0, so that equal points have equal patterns.
std::array<std::uint32_t, 3> bits_of(const Eigen::Vector3f& point) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value + 0.0F); };
  return {bits(point.x()), bits(point.y()), bits(point.z())};
}

Keyed keyed(const Eigen::Vector3f& point, std::uint32_t index) {
  std::uint64_t hash = 0;
  for (const std::uint32_t part : bits_of(point)) hash = (hash ^ part) * 0x9e3779b97f4a7c15U;
  return {hash ^ (hash >> 32), index};
}

// Marks every point that repeats an earlier one.
std::vector<std::uint8_t> repeats(const std::vector<Eigen::Vector3f>& points, const Context& context) {
  std::vector<Keyed> order(points.size());
  parallel_for(context, points.size(), 1 << 14,
               [&](std::size_t i) { order[i] = keyed(points[i], static_cast<std::uint32_t>(i)); });
  stable_parallel_sort(context, order, [](const Keyed& a, const Keyed& b) {
    return a.hash != b.hash ? a.hash < b.hash : a.index < b.index;
  });
  std::vector<std::uint8_t> repeated(points.size(), 0);
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && order[end].hash == order[begin].hash) ++end;
    for (std::size_t i = begin + 1; i < end; ++i) {  // different points may share a hash
      repeated[order[i].index] = std::any_of(
          order.begin() + static_cast<std::ptrdiff_t>(begin), order.begin() + static_cast<std::ptrdiff_t>(i),
          [&](const Keyed& earlier) { return bits_of(points[earlier.index]) == bits_of(points[order[i].index]); });
    }
  }
  return repeated;
}

Eigen::Vector3f unit_or_zero(const Eigen::Vector3f& normal) {
  const float length = normal.norm();
  return std::isfinite(length) && length > 1e-12F ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::Zero();
}

}  // namespace

Sanitised sanitise(const PointCloud& raw, const Context& context) {
  Sanitised result;
  SanitiserReport& report = result.report;
  report.points_in = raw.size();

  PointCloud valid;
  std::vector<std::uint32_t> valid_index;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const Eigen::Vector3f& point = raw.positions[i];
    if (!point.allFinite()) {
      ++report.not_finite;
    } else if (point.isZero(0.0F)) {
      ++report.no_return;
    } else {
      valid.positions.push_back(point);
      if (raw.has_normals()) valid.normals.push_back(unit_or_zero(raw.normals[i]));
      valid_index.push_back(static_cast<std::uint32_t>(i));
    }
  }

  const std::vector<std::uint8_t> repeated = repeats(valid.positions, context);
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (repeated[i] != 0) {
      ++report.duplicates;
      continue;
    }
    result.cloud.positions.push_back(valid.positions[i]);
    result.source_index.push_back(valid_index[i]);
    if (!valid.has_normals()) continue;
    result.cloud.normals.push_back(valid.normals[i]);
    if (valid.normals[i].isZero(0.0F)) ++report.zero_normals;
  }
  return result;
}

}  // namespace asbuilt::scan
