// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/point_sieve.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/scan_file.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kGrain = 4096;

bool is_point(const Eigen::Vector3f& position) { return position.allFinite() && !position.isZero(0.0F); }

/// floor, without the call that it is on processors without SSE4.1; still an integer of 64 bits.
std::int64_t cell_of(float coordinate, double size) {
  constexpr double kFarthest = 4e18;
  const double cell = std::clamp(static_cast<double>(coordinate) / size, -kFarthest, kFarthest);
  const auto whole = static_cast<std::int64_t>(cell);
  return whole - (static_cast<double>(whole) > cell ? 1 : 0);
}

/// A number for the cube that a point lies in.
std::uint64_t key_of(const Eigen::Vector3f& position, double size) {
  // Odd numbers without a pattern; the last steps are those of splitmix64.
  std::uint64_t key = static_cast<std::uint64_t>(cell_of(position.x(), size)) * 0x9e3779b97f4a7c15u +
                      static_cast<std::uint64_t>(cell_of(position.y(), size)) * 0xc2b2ae3d27d4eb4fu +
                      static_cast<std::uint64_t>(cell_of(position.z(), size)) * 0x165667b19e3779f9u;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
  return key ^ (key >> 31);
}

/// Moves the kept entries of an attribute to the front.
template <class T>
void keep_only(std::vector<T>& values, const std::vector<std::uint32_t>& kept) {
  if (values.empty()) return;
  for (std::size_t i = 0; i < kept.size(); ++i) values[i] = values[kept[i]];
  values.resize(kept.size());
}

/// A part of the table of cubes. Of a key the upper half tells the place and the lower half is what stands there, so
/// two cubes are confused about once in 2^32 look-ups, which costs a point at most.
class Slots {
 public:
  Slots(std::span<std::uint32_t> table, std::size_t part, std::size_t parts)
      : table_(table), begin_(table.size() * part / parts), end_(table.size() * (part + 1) / parts) {}

  [[nodiscard]] bool own(std::uint64_t key) const {
    const std::size_t home = home_of(key);
    return begin_ <= home && home < end_;
  }
  void prefetch(std::uint64_t key) const { __builtin_prefetch(table_.data() + home_of(key), 1); }

  /// Whether the cube was free; then it is occupied.
  [[nodiscard]] bool take(std::uint64_t key) {
    const std::uint32_t mark = std::max(static_cast<std::uint32_t>(key), std::uint32_t{1});
    for (std::size_t at = home_of(key);; at = at + 1 < end_ ? at + 1 : begin_) {
      if (table_[at] == mark) return false;
      if (table_[at] != 0) continue;
      table_[at] = mark;
      return true;
    }
  }

 private:
  [[nodiscard]] std::size_t home_of(std::uint64_t key) const {
    return static_cast<std::size_t>(((key >> 32) * table_.size()) >> 32);
  }

  std::span<std::uint32_t> table_;
  std::size_t begin_, end_;
};

}  // namespace

SievedPoints::SievedPoints(ScanFile& scan, const PointSieve* sieve, std::uint64_t declared, const Context& context)
    : scan_(scan),
      sieve_(sieve),
      context_(context),
      capacity_(sieve == nullptr ? std::numeric_limits<std::size_t>::max() : sieve->room()),
      declared_(declared) {
  if (sieve_ != nullptr && sieve_->announced) sieve_->announced(declared_);
}

void SievedPoints::add(std::span<const Eigen::Vector3f> positions, const Append& append) {
  ASBUILT_EXPECT(positions.size() <= kLargestBlock, "a block of at most kLargestBlock points");
  choose(positions);
  for (std::size_t at = 0; at < positions.size();) {
    if (size_mm_ > 0.0)
      occupy(positions.subspan(at), std::span(choices_).subspan(at), std::span(is_first_).subspan(at));
    staying_.clear();
    bool is_full = false;
    for (const std::size_t room = capacity_ - scan_.cloud.size(); at < positions.size(); ++at) {
      if (choices_[at] == Choice::no || (choices_[at] == Choice::while_there_is_room && size_mm_ > 0.0)) continue;
      is_full = staying_.size() == room;
      if (is_full) break;
      if (size_mm_ == 0.0 || is_first_[at] != 0) staying_.push_back(static_cast<std::uint32_t>(at));
    }
    for (const std::uint32_t place : staying_) scan_.cloud.positions.push_back(positions[place]);
    append(staying_);
    if (is_full) make_room();
  }
  seen_ += positions.size();
  if (sieve_ == nullptr) return;
  if (sieve_->progress && declared_ > 0) sieve_->progress(static_cast<double>(seen_) / static_cast<double>(declared_));
  cancelled_ = cancelled_ || (sieve_->cancelled && sieve_->cancelled());
}

void SievedPoints::choose(std::span<const Eigen::Vector3f> positions) {
  choices_.assign(positions.size(), Choice::while_there_is_room);
  is_first_.resize(positions.size());
  if (sieve_ == nullptr) return;
  std::atomic<std::uint64_t> points = 0;
  parallel_for_blocks(context_, positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::uint64_t some = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const bool is_some = is_point(positions[i]);
      some += is_some ? 1 : 0;
      if (sieve_->wants) {
        const bool is_wanted = is_some && sieve_->wants(positions[i].cast<double>() + scan_.offset_mm);
        choices_[i] = is_wanted ? Choice::yes : Choice::no;
      } else if (is_some) {
        choices_[i] = Choice::yes;
      }
    }
    points += some;
  });
  points_ += points;
}

void SievedPoints::occupy(std::span<const Eigen::Vector3f> positions, std::span<const Choice> choices,
                          std::span<std::uint8_t> is_first) {
  keys_.resize(positions.size());
  parallel_for(context_, positions.size(), kGrain, [&](std::size_t i) {
    keys_[i] = choices[i] == Choice::yes ? std::max(key_of(positions[i], size_mm_), std::uint64_t{1}) : 0;
    is_first[i] = 0;
  });
  // Each thread looks after a part of the table, and meets the cubes of that part in the order of the file.
  const auto parts = static_cast<std::size_t>(context_.arena().threads());
  parallel_for(context_, parts, 1, [&](std::size_t part) {
    Slots slots(occupied_, part, parts);
    std::array<std::uint32_t, 64> places;  // fetched while the next ones are looked for
    std::size_t count = 0;
    const auto take_them = [&] {
      for (std::size_t k = 0; k < count; ++k) is_first[places[k]] = slots.take(keys_[places[k]]) ? 1 : 0;
      count = 0;
    };
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (keys_[i] == 0 || !slots.own(keys_[i])) continue;
      slots.prefetch(keys_[i]);
      places[count++] = static_cast<std::uint32_t>(i);
      if (count == places.size()) take_them();
    }
    take_them();
  });
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
    occupied_.resize(2 * (capacity_ + kLargestBlock));  // at most half full, also with a block that is yet to be cut
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
  const std::span<const Eigen::Vector3f> all = scan_.cloud.positions;
  std::vector<Choice> choices(std::min(all.size(), kLargestBlock));
  std::vector<std::uint8_t> is_first(choices.size());
  for (std::size_t begin = 0; begin < all.size(); begin += kLargestBlock) {
    const auto block = all.subspan(begin, std::min(kLargestBlock, all.size() - begin));
    for (std::size_t i = 0; i < block.size(); ++i) choices[i] = is_point(block[i]) ? Choice::yes : Choice::no;
    occupy(block, choices, is_first);
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (is_first[i] != 0) kept.push_back(static_cast<std::uint32_t>(begin + i));
    }
  }
  keep_only(scan_.cloud.positions, kept);
  keep_only(scan_.cloud.normals, kept);
  keep_only(scan_.colours, kept);
  keep_only(scan_.intensities, kept);
}

void SievedPoints::finish() {
  if (sieve_ != nullptr) sieve_->kept_of_file += scan_.cloud.size();
  if (size_mm_ == 0.0) return;
  scan_.thinning = Thinning{points_, size_mm_};
}

}  // namespace asbuilt::io
