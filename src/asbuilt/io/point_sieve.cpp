// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/point_sieve.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "asbuilt/io/scan_file.h"

namespace asbuilt::io {
namespace {

constexpr std::uint64_t kPointsBetweenQuestions = 1 << 16;

bool is_point(const Eigen::Vector3f& position) { return position.allFinite() && !position.isZero(0.0F); }

/// A number for the cube that a point lies in, never 0. Two cubes in 2^64 share one, which costs a point at most.
std::uint64_t key_of(const Eigen::Vector3f& position, double size) {
  constexpr double kFarthest = 4e18;  // still an integer of 64 bits
  std::uint64_t key = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(static_cast<double>(position[axis]) / size);
    const auto index = static_cast<std::uint64_t>(static_cast<std::int64_t>(std::clamp(cell, -kFarthest, kFarthest)));
    key = (key ^ index) + 0x9e3779b97f4a7c15u;  // the mixing steps of splitmix64
    key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
    key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
    key ^= key >> 31;
  }
  return key == 0 ? 1 : key;
}

/// Moves the kept entries of an attribute to the front.
template <class T>
void keep_only(std::vector<T>& values, const std::vector<std::uint32_t>& kept) {
  if (values.empty()) return;
  for (std::size_t i = 0; i < kept.size(); ++i) values[i] = values[kept[i]];
  values.resize(kept.size());
}

}  // namespace

SievedPoints::SievedPoints(ScanFile& scan, const PointSieve* sieve, std::uint64_t declared)
    : scan_(scan), sieve_(sieve), capacity_(sieve == nullptr ? 0 : sieve->room()), declared_(declared) {
  if (sieve_ != nullptr && sieve_->announced) sieve_->announced(declared_);
}

bool SievedPoints::add(const Eigen::Vector3f& position) {
  if (sieve_ == nullptr) {
    scan_.cloud.positions.push_back(position);
    return true;
  }
  if (++seen_ % kPointsBetweenQuestions == 0) {
    if (sieve_->progress && declared_ > 0) {
      sieve_->progress(static_cast<double>(seen_) / static_cast<double>(declared_));
    }
    cancelled_ = cancelled_ || (sieve_->cancelled && sieve_->cancelled());
  }
  const bool is_some = is_point(position);
  points_ += is_some ? 1 : 0;
  if (sieve_->wants && (!is_some || !sieve_->wants(position.cast<double>() + scan_.offset_mm))) return false;
  if (scan_.cloud.size() >= capacity_) make_room();
  if (size_mm_ > 0.0 && (!is_some || !occupy(position))) return false;
  scan_.cloud.positions.push_back(position);
  return true;
}

void SievedPoints::make_room() {
  double size = size_mm_ * std::numbers::sqrt2;
  if (size_mm_ == 0.0) {
    // So fine at first that hardly two points share a cube.
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
    for (const Eigen::Vector3f& position : scan_.cloud.positions) {
      if (!is_point(position)) continue;
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
    }
    const double extent = static_cast<double>((high - low).maxCoeff());
    size = extent > 0.0 ? 0.1 * extent / std::sqrt(static_cast<double>(capacity_)) : 1e-3;
    occupied_.assign(std::bit_ceil(2 * capacity_ + 16), 0);
  }
  while (true) {
    thin(size);
    if (2 * scan_.cloud.size() <= capacity_ || scan_.cloud.size() <= 1) return;
    size *= std::numbers::sqrt2;
  }
}

void SievedPoints::thin(double size) {
  size_mm_ = size;
  std::ranges::fill(occupied_, 0);
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < scan_.cloud.size(); ++i) {
    const Eigen::Vector3f& position = scan_.cloud.positions[i];
    if (is_point(position) && occupy(position)) kept.push_back(static_cast<std::uint32_t>(i));
  }
  keep_only(scan_.cloud.positions, kept);
  keep_only(scan_.cloud.normals, kept);
  keep_only(scan_.colours, kept);
  keep_only(scan_.intensities, kept);
}

bool SievedPoints::occupy(const Eigen::Vector3f& position) {
  const std::uint64_t key = key_of(position, size_mm_);
  const std::size_t mask = occupied_.size() - 1;
  for (std::size_t at = static_cast<std::size_t>(key) & mask;; at = (at + 1) & mask) {
    if (occupied_[at] == key) return false;
    if (occupied_[at] != 0) continue;
    occupied_[at] = key;
    return true;
  }
}

void SievedPoints::finish() {
  if (sieve_ != nullptr) sieve_->kept_of_file += scan_.cloud.size();
  if (size_mm_ == 0.0) return;
  scan_.thinning = Thinning{points_, size_mm_};
}

}  // namespace asbuilt::io
