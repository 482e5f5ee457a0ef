// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/lost_end.h"

#include <algorithm>
#include <array>
#include <ranges>

#include "asbuilt/verify/size.h"

namespace asbuilt::verify {
namespace {

constexpr std::size_t kSlabs = 24;    // across the part's box
constexpr double kMostlyLost = 0.85;  // of what was looked at in an end that is lost
constexpr double kLengthHeld = 1e-4;  // flat faces along an axis hold 1e-5 and less, other surface 2e-4 and more

/// A part of the model between two planes across an axis, and what became of it.
struct Slab {
  PoseEvidence evidence;
  double lever = 0.0;  ///< of its middle from the part's centre, in half diameters
};
using Slabs = std::array<Slab, kSlabs>;

double asked(const PoseEvidence& e) { return e.facing - e.hidden; }

Slabs slabs_along(int axis, const Pose& model_from_scan, const model::PreparedModel& model, const ScanEvidence& scan,
                  const EvidenceOptions& options) {
  const double low = model.box.min()[axis], length = model.box.sizes()[axis];
  std::array<PointCloud, kSlabs> samples;
  const PointCloud& all = model.dense_samples;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double place = (static_cast<double>(all.positions[i][axis]) - low) / length * static_cast<double>(kSlabs);
    PointCloud& slab = samples[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(kSlabs - 1)))];
    slab.positions.push_back(all.positions[i]);
    slab.normals.push_back(all.normals[i]);
  }
  Slabs slabs;
  for (std::size_t s = 0; s < kSlabs; ++s) {
    slabs[s].evidence = evidence_for(model_from_scan, samples[s], model, scan, options);
    const double middle = low + (static_cast<double>(s) + 0.5) / static_cast<double>(kSlabs) * length;
    slabs[s].lever = (middle - model.box.center()[axis]) / (0.5 * model.diameter);
  }
  return slabs;
}

// The same of growth along one axis as of growth in all: a slab moves as a whole.
double length_hold(int axis, const Slabs& slabs) {
  PoseEvidence along;
  for (const Slab& slab : slabs) {
    const Matrix6d& own = slab.evidence.information;
    along.information += own;
    along.twist_growth += slab.lever * own.col(3 + axis);
    along.growth += slab.lever * slab.lever * own(3 + axis, 3 + axis);
    along.explained_samples += slab.evidence.explained_samples;
  }
  return size_hold(along);
}

// From the first slab inwards, what was looked at and gave nothing back, for as long as that is nearly all.
template <class Range>
double lost_from(const Range& inwards) {
  double missing = 0.0, looked_at = 0.0, lost = 0.0;
  for (const Slab& slab : inwards) {
    missing += slab.evidence.missing;
    looked_at += asked(slab.evidence);
    if (looked_at > 0.0 && missing < kMostlyLost * looked_at) break;
    lost = missing;
  }
  return lost;
}

}  // namespace

double lost_end_share(const Pose& model_from_scan, const model::PreparedModel& model, const ScanEvidence& scan,
                      const EvidenceOptions& options) {
  double most = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(model.box.sizes()[axis] > 0.0)) continue;
    const Slabs slabs = slabs_along(axis, model_from_scan, model, scan, options);
    double whole = 0.0;
    for (const Slab& slab : slabs) whole += asked(slab.evidence);
    if (whole <= 0.0 || length_hold(axis, slabs) >= kLengthHeld) continue;
    most = std::max({most, lost_from(slabs) / whole, lost_from(std::views::reverse(slabs)) / whole});
  }
  return most;
}

}  // namespace asbuilt::verify
