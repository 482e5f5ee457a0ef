// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/segment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/verify/flying_points.h"

namespace asbuilt::verify {
namespace {

enum class Kind : std::uint8_t { certain, departing, beyond };

struct Candidate {
  std::uint32_t index;
  Kind kind;
  float deviation_mm = 0.0F;  ///< from the CAD, signed
};

// Points around the model, told apart by their distance to the CAD and their normal. `beyond` is one more reach wide:
// enough to see whether a surface goes on.
std::vector<Candidate> candidates(const Pose& model_from_scan, const model::PreparedModel& model,
                                  const scan::Scan& scan, const std::vector<std::uint8_t>& background,
                                  const KdTree& tree, const SegmentOptions& options, const Context& context) {
  const Eigen::Vector3d centre = model_from_scan.inverse() * model.box.center().eval();
  std::vector<KdTree::Neighbour> around;
  tree.within(centre.cast<float>(), static_cast<float>(0.5 * model.diameter + 2.0 * options.reach_mm), around);
  std::vector<Candidate> found(around.size());
  const double min_cosine = std::cos(options.max_normal_angle);
  constexpr std::uint32_t kOutside = std::numeric_limits<std::uint32_t>::max();
  parallel_for(context, around.size(), 512, [&](std::size_t i) {
    const std::uint32_t index = around[i].index;
    const Eigen::Vector3d point = model_from_scan * scan.cloud.positions[index].cast<double>();
    const auto nearest = model.surface->nearest(point, 2.0 * options.reach_mm);
    found[i] = {nearest.found() ? index : kOutside, Kind::beyond, static_cast<float>(nearest.signed_distance)};
    if (!nearest.found() || background[index] != 0) return;
    const Eigen::Vector3d model_normal = model.face_normals[nearest.triangle].cast<double>();
    const double cosine = model_normal.dot(model_from_scan.linear() * scan.cloud.normals[index].cast<double>());
    const bool agrees = (scan.normals_oriented && !model.is_open() ? cosine : std::abs(cosine)) >= min_cosine;
    const double distance = std::abs(nearest.signed_distance);
    if (distance <= options.band_mm && agrees) {
      found[i].kind = Kind::certain;
    } else if (distance <= options.reach_mm) {
      found[i].kind = Kind::departing;
    }
  });
  std::erase_if(found, [](const Candidate& candidate) { return candidate.index == kOutside; });
  return found;
}

// Connected surfaces among the points that are not certain; `touches_part` and `goes_on` per candidate's surface.
struct Surfaces {
  DisjointSets pieces;
  std::vector<std::size_t> certain_contacts, beyond_members, members;
};

Surfaces connected_surfaces(const std::vector<Candidate>& all, const scan::Scan& scan, const KdTree& tree,
                            const Context& context) {
  constexpr std::size_t kNeighbours = 9;
  constexpr float kLinkInSpacings = 3.0F;
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> candidate_of(scan.cloud.size(), kNone);
  for (std::size_t i = 0; i < all.size(); ++i) candidate_of[all[i].index] = static_cast<std::uint32_t>(i);

  std::vector<std::vector<std::uint32_t>> links(all.size());
  const float reach = kLinkInSpacings * static_cast<float>(scan.spacing_mm);
  parallel_for_blocks(context, all.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      if (all[i].kind == Kind::certain) continue;
      tree.nearest(scan.cloud.positions[all[i].index], kNeighbours, neighbours);
      for (const KdTree::Neighbour& neighbour : neighbours) {
        const std::uint32_t other = candidate_of[neighbour.index];
        if (other == kNone || other == i || neighbour.squared_distance > reach * reach) continue;
        links[i].push_back(other);
      }
    }
  });

  Surfaces result{DisjointSets(static_cast<int>(all.size())), {}, {}, {}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const std::uint32_t other : links[i]) {
      if (all[other].kind != Kind::certain) result.pieces.unite(static_cast<int>(i), static_cast<int>(other));
    }
  }
  result.certain_contacts.assign(all.size(), 0);
  result.beyond_members.assign(all.size(), 0);
  result.members.assign(all.size(), 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind == Kind::certain) continue;
    const auto root = static_cast<std::size_t>(result.pieces.find(static_cast<int>(i)));
    ++result.members[root];
    result.beyond_members[root] += all[i].kind == Kind::beyond ? 1 : 0;
    for (const std::uint32_t other : links[i])
      result.certain_contacts[root] += all[other].kind == Kind::certain ? 1 : 0;
  }
  return result;
}

// Beams that met two surfaces at once measured neither: they go to the margin.
void set_flying_aside(Segment& segment, std::span<const float> deviation_mm, const scan::Scan& scan,
                      const Context& context) {
  const std::vector<std::uint8_t> flying = flying_points(segment.part, deviation_mm, scan, context);
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < flying.size(); ++i) (flying[i] != 0 ? segment.margin : kept).push_back(segment.part[i]);
  segment.part = std::move(kept);
  std::ranges::sort(segment.margin);
}

}  // namespace

Segment segment_part(const Pose& model_from_scan, const model::PreparedModel& model, const scan::Scan& scan,
                     const std::vector<std::uint8_t>& background, const SegmentOptions& options,
                     const Context& context) {
  const KdTree tree(scan.cloud.positions, context);
  const std::vector<Candidate> all = candidates(model_from_scan, model, scan, background, tree, options, context);
  Surfaces surfaces = connected_surfaces(all, scan, tree, context);
  Segment segment;
  std::vector<float> deviation_mm;  // of the part
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind == Kind::beyond) continue;
    const auto root = static_cast<std::size_t>(surfaces.pieces.find(static_cast<int>(i)));
    // A flying point or two beyond does not make a dent's surface clutter; a twentieth does.
    const bool ends_within = 20 * surfaces.beyond_members[root] <= surfaces.members[root];
    const bool belongs = all[i].kind == Kind::certain || (ends_within && surfaces.certain_contacts[root] > 0);
    (belongs ? segment.part : segment.margin).push_back(all[i].index);
    if (belongs) deviation_mm.push_back(all[i].deviation_mm);
  }
  set_flying_aside(segment, deviation_mm, scan, context);
  return segment;
}

}  // namespace asbuilt::verify
