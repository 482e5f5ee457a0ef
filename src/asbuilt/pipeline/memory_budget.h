// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/io/point_sieve.h"

namespace asbuilt::pipeline {

/// What a run may take of the machine's memory, and what of it one scan may hold.
struct MemoryBudget {
  /// `gigabytes` as the user states them; 0: half of what the machine (or its container) has.
  explicit MemoryBudget(double gigabytes);

  /// Bytes that a scan of so many points is expected to take at its peak, model and program included.
  [[nodiscard]] static double predicted_bytes(std::uint64_t points);
  /// Points of a scan that fit, at least 20 000: with fewer, nothing could be found.
  [[nodiscard]] std::size_t points_that_fit() const;

  double bytes = 0.0;
};

/// The sieve with which the scans of a file are read, so that each fits. Where one does not, a warning says beforehand
/// what it would need and what is done instead. `context` must outlive the sieve.
[[nodiscard]] std::shared_ptr<io::PointSieve> sieve_for(const std::string& path, const MemoryBudget& budget,
                                                        const Context& context);

}  // namespace asbuilt::pipeline
