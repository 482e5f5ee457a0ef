// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_distance.h"

#include "asbuilt/model/surface_search.h"

namespace asbuilt::model {

struct SurfaceDistance::Implementation {
  SurfaceSearch search;
};

SurfaceDistance::SurfaceDistance(const TriangleMesh& mesh)
    : implementation_(std::make_unique<Implementation>(SurfaceSearch(mesh))) {}
SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

const SurfaceSearch& SurfaceDistance::search() const { return implementation_->search; }

SurfaceDistance::Nearest SurfaceDistance::nearest(const Eigen::Vector3d& point, double max_distance) const {
  if (!point.allFinite() || !(max_distance >= 0.0)) return {};
  return implementation_->search.nearest(point, max_distance * max_distance);
}

SurfaceDistance::Nearest SurfaceDistance::nearest_from_guess(const Eigen::Vector3d& point, std::uint32_t guess) const {
  if (!point.allFinite()) return {};
  return implementation_->search.nearest(point, std::numeric_limits<double>::infinity(), guess);
}

}  // namespace asbuilt::model
