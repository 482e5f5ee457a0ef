// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/sanitise.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

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

// Sorted in `buckets` (a power of two) by the leading bits of their hash; in a bucket by index.
struct Buckets {
  std::vector<Keyed> keyed;
  std::vector<std::size_t> starts;  // one more than there are buckets
};

Buckets in_buckets(const std::vector<Eigen::Vector3f>& points, const Context& context) {
  constexpr std::size_t kGrain = 1 << 16;
  constexpr std::size_t kPerBucket = 1 << 13;  // they stay in the nearest cache while they are sorted
  const std::size_t count = std::clamp<std::size_t>(std::bit_ceil(points.size() / kPerBucket), 2, 4096);
  const int shift = 64 - std::countr_zero(count);
  // How many of each block of points go into each bucket, then where they start.
  const std::size_t blocks = (points.size() + kGrain - 1) / kGrain;
  std::vector<std::uint32_t> places(blocks * count, 0);
  parallel_for_blocks(context, points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const mine = places.data() + begin / kGrain * count;
    for (std::size_t i = begin; i < end; ++i) ++mine[keyed(points[i], 0).hash >> shift];
  });
  Buckets result;
  result.starts.assign(count + 1, 0);
  std::uint32_t before = 0;
  for (std::size_t bucket = 0; bucket < count; ++bucket) {
    for (std::size_t block = 0; block < blocks; ++block) {
      before += std::exchange(places[block * count + bucket], before);
    }
    result.starts[bucket + 1] = before;
  }
  result.keyed.resize(points.size());
  parallel_for_blocks(context, points.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const mine = places.data() + begin / kGrain * count;
    for (std::size_t i = begin; i < end; ++i) {
      const Keyed key = keyed(points[i], static_cast<std::uint32_t>(i));
      result.keyed[mine[key.hash >> shift]++] = key;
    }
  });
  return result;
}

// Marks every point that repeats an earlier one.
std::vector<std::uint8_t> repeats(const std::vector<Eigen::Vector3f>& points, const Context& context) {
  Buckets buckets = in_buckets(points, context);
  std::vector<std::uint8_t> repeated(points.size(), 0);
  parallel_for(context, buckets.starts.size() - 1, 1, [&](std::size_t bucket) {
    const auto at = [&](std::size_t place) { return buckets.keyed.begin() + static_cast<std::ptrdiff_t>(place); };
    const std::size_t last = buckets.starts[bucket + 1];
    std::sort(at(buckets.starts[bucket]), at(last),
              [](const Keyed& a, const Keyed& b) { return a.hash != b.hash ? a.hash < b.hash : a.index < b.index; });
    for (std::size_t begin = buckets.starts[bucket], end = begin; begin < last; begin = end) {
      while (end < last && buckets.keyed[end].hash == buckets.keyed[begin].hash) ++end;
      for (std::size_t i = begin + 1; i < end; ++i) {  // different points may share a hash
        const auto is_same = [&](const Keyed& earlier) {
          return bits_of(points[earlier.index]) == bits_of(points[buckets.keyed[i].index]);
        };
        repeated[buckets.keyed[i].index] = std::any_of(at(begin), at(i), is_same) ? 1 : 0;
      }
    }
  });
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
  valid.positions.reserve(raw.size());
  valid_index.reserve(raw.size());
  if (raw.has_normals()) valid.normals.reserve(raw.size());
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
  result.cloud.positions.reserve(valid.size());
  result.source_index.reserve(valid.size());
  if (valid.has_normals()) result.cloud.normals.reserve(valid.size());
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
