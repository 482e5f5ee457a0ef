// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/memory_budget.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace asbuilt::pipeline {
namespace {

// Measured as the peak of whole runs over scans of 0.2 to 4 million points (bench/big/run): the program with a model of
// usual size, and each further point with its normal, its places in sorting and searching, and in the segment.
constexpr double kBytesOfProgram = 0.2e9;
constexpr double kBytesPerPoint = 220.0;
constexpr std::size_t kFewestPoints = 20000;

/// What the machine has, or the container that this runs in.
double bytes_of_machine() {
  const double machine = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  double container = 0.0;
  std::ifstream("/sys/fs/cgroup/memory.max") >> container;  // "max", or no such file: stays 0
  return container > 0.0 ? std::min(machine, container) : machine;
}

}  // namespace

MemoryBudget::MemoryBudget(double gigabytes) : bytes(gigabytes > 0.0 ? 1e9 * gigabytes : 0.5 * bytes_of_machine()) {}

double MemoryBudget::predicted_bytes(std::uint64_t points) {
  return kBytesOfProgram + kBytesPerPoint * static_cast<double>(points);
}

std::size_t MemoryBudget::points_that_fit() const {
  const double points = (bytes - kBytesOfProgram) / kBytesPerPoint;
  return points > static_cast<double>(kFewestPoints) ? static_cast<std::size_t>(points) : kFewestPoints;
}

std::shared_ptr<io::PointSieve> sieve_for(const std::string& path, const MemoryBudget& budget, const Context& context) {
  auto sieve = std::make_shared<io::PointSieve>();
  sieve->capacity = budget.points_that_fit();
  sieve->announced = [path, budget, capacity = sieve->capacity, &context](std::uint64_t points) {
    if (points <= capacity) return;
    context.warn(
        fmt::format("{}: {} points would need about {:.1f} GB of memory, {:.1f} GB may be used (--memory): the part is "
                    "sought in an "
                    "evenly thinned scan of at most {} points, and measured in all points around it, read once more",
                    path, points, 1e-9 * MemoryBudget::predicted_bytes(points), 1e-9 * budget.bytes, capacity));
  };
  sieve->progress = context.progress;
  sieve->cancelled = [&context] { return context.cancelled(); };
  return sieve;
}

}  // namespace asbuilt::pipeline
