// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "asbuilt/core/context.h"

namespace asbuilt::io {

struct ScanFile;

/// How many points of a scan a reader may keep, and which. Without one, all.
struct PointSieve {
  std::size_t capacity = 0;  ///< points kept of a scan, at most; beyond it the scan is thinned evenly
  /// Points that are wanted, by their place in the scan frame (offset included), mm; empty: all. Asked by any thread.
  std::function<bool(const Eigen::Vector3d&)> wants;
  /// Told before the points of a scan are read, if their number is known then.
  std::function<void(std::uint64_t points)> announced;
  std::function<void(double)> progress;  ///< share of the points of a scan that have been looked at
  std::function<bool()> cancelled;       ///< reading ends where it is, with what there is

  /// Points kept of the scans of the file so far: they wait in memory while the others are read.
  mutable std::size_t kept_of_file = 0;

  /// Points that may be kept of the next scan. One that is worked on takes seven times what it takes while it waits.
  [[nodiscard]] std::size_t room() const {
    return std::max(capacity / 8, capacity - std::min(capacity, kept_of_file / 7));
  }
  /// Whether a scan of so many points is thinned or sifted.
  [[nodiscard]] bool applies_to(std::uint64_t points) const { return wants || points > room(); }
};

/// Fills a scan within the bounds of a sieve, block by block. While there is room every point stays, also those that
/// are none (NaN, no-returns), in the order of the file. When there is none, one point in each cube of a grid stays,
/// the first, and the grid grows coarser by a factor of sqrt(2) whenever that is still too much; points that are none
/// go. Memory: the capacity and 8 bytes a point of it. The same for the same file, whatever the blocks and the threads.
class SievedPoints {
 public:
  /// Told which points of the block stay, by their places in it; then it appends their attributes, and nothing else, to
  /// the scan. The positions are appended already.
  using Append = std::function<void(std::span<const std::uint32_t> staying)>;

  /// `sieve` may be nullptr; it, the scan and the context must outlive this. `declared` is how many points are to come.
  SievedPoints(ScanFile& scan, const PointSieve* sieve, std::uint64_t declared, const Context& context);

  static constexpr std::size_t kLargestBlock = 65536;
  /// The next points of the file, at most kLargestBlock and best about as many: in mm, offset taken off; NaN for what
  /// is no point.
  void add(std::span<const Eigen::Vector3f> positions, const Append& append);
  /// Whether reading has been called off.
  [[nodiscard]] bool cancelled() const { return cancelled_; }
  /// Writes down in the scan what was done to it.
  void finish();

 private:
  enum class Choice : std::uint8_t { no, while_there_is_room, yes };

  void choose(std::span<const Eigen::Vector3f> positions);
  /// Of the points with the choice `yes`, finds the first in each cube that nobody has occupied so far.
  void occupy(std::span<const Eigen::Vector3f> positions, std::span<const Choice> choices,
              std::span<std::uint8_t> is_first);
  void make_room();
  void thin(double size);

  ScanFile& scan_;
  const PointSieve* sieve_;
  const Context& context_;
  std::size_t capacity_ = 0;
  std::uint64_t declared_, seen_ = 0, points_ = 0;  // points_: those that are some
  bool cancelled_ = false;
  double size_mm_ = 0.0;                 // edge of a cube; 0: every point stays
  std::vector<std::uint32_t> occupied_;  // open addressing, 0 is free
  // Of the block at hand:
  std::vector<Choice> choices_;
  std::vector<std::uint8_t> is_first_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> staying_;
};

}  // namespace asbuilt::io
