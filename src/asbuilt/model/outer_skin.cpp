// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/outer_skin.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/model/mesh_cleaning.h"
#include "asbuilt/model/mesh_edges.h"

namespace asbuilt::model {
namespace {

constexpr double kPinhole = 0.02;         // of the diameter: hidden spots smaller than its square stay
constexpr double kBoreShare = 0.001;      // what the bottom of a hole sees that is sixteen times as deep as wide
constexpr float kCovered = 0.5F;          // of its spots, from which on a face counts as covered by another body
constexpr double kOpenShellShare = 0.35;  // a bowl's inside sees half of what its outside sees; a closed part's nothing
constexpr double kClearMajority = 0.6;    // of a patch's area, to believe the file's winding on an open shell

double area_of(const TriangleMesh& mesh, std::size_t triangle) {
  return 0.5 * doubled_area_vector(mesh, triangle).norm();
}

// Hidden faces that hang together over edges.
struct HiddenGroup {
  double area = 0.0, seen_area = 0.0;  // mm^2; weighted by the share of escaped rays
  bool touches_visible = false;
};

// What hides next to plainly visible faces stays if it is a pinhole or sees a little on the whole: the walls of a bore,
// the bottom of a groove. A scanner may well catch some of it, and without it the skin would be open and the distance
// lose its sign. What another body covers is no part of that: it may hang together with what is seen (a sleeve in a
// housing of which the rim is in sight), but it lies inside. `keep` comes with the plainly visible faces.
void keep_bores_and_pinholes(const TriangleMesh& mesh, const std::vector<FaceVisibility>& visibility,
                             std::vector<std::uint8_t>& keep) {
  const std::vector<EdgeSide> sides = sorted_sides(mesh);
  const auto is_kept = [&](const EdgeSide& side) { return keep[side.triangle] != 0; };
  DisjointSets linked(static_cast<int>(mesh.triangles.size()));
  const auto is_candidate = [&](std::size_t i) { return keep[i] == 0 && visibility[i].covered < kCovered; };
  for_each_edge(sides, [&](std::span<const EdgeSide> faces) {
    const EdgeSide* previous = nullptr;
    for (const EdgeSide& side : faces) {
      if (!is_candidate(side.triangle)) continue;
      if (previous != nullptr) linked.unite(static_cast<int>(previous->triangle), static_cast<int>(side.triangle));
      previous = &side;
    }
  });
  std::vector<HiddenGroup> groups(mesh.triangles.size());
  const auto group_of = [&](std::size_t i) -> HiddenGroup& {
    return groups[static_cast<std::size_t>(linked.find(static_cast<int>(i)))];
  };
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!is_candidate(i)) continue;
    group_of(i).area += area_of(mesh, i);
    group_of(i).seen_area += area_of(mesh, i) * static_cast<double>(std::max(visibility[i].front, visibility[i].back));
  }
  for_each_edge(sides, [&](std::span<const EdgeSide> faces) {
    if (std::ranges::none_of(faces, is_kept)) return;
    for (const EdgeSide& side : faces) {
      if (is_candidate(side.triangle)) group_of(side.triangle).touches_visible = true;
    }
  });
  const double pinhole = std::pow(kPinhole * diameter(mesh), 2);
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!is_candidate(i)) continue;
    const HiddenGroup& group = group_of(i);
    const bool is_small = group.area < pinhole, sees_a_little = group.seen_area >= kBoreShare * group.area;
    if (group.touches_visible && (is_small || sees_a_little)) keep[i] = 1;
  }
}

struct Neighbour {
  std::uint32_t triangle;
  bool same_winding;
};

// Neighbours over edges that have exactly two faces, in CSR form.
struct Neighbourhood {
  std::vector<std::uint32_t> begin;
  std::vector<Neighbour> neighbours;
};

Neighbourhood manifold_neighbours(const TriangleMesh& mesh) {
  struct Link {
    std::uint32_t from;
    Neighbour to;
  };
  std::vector<Link> links;
  for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) {
    if (faces.size() != 2) return;
    const EdgeSide &a = faces[0], &b = faces[1];
    const bool same = a.ascending != b.ascending;  // consistent faces run a shared edge in opposite directions
    links.push_back({a.triangle, {b.triangle, same}});
    links.push_back({b.triangle, {a.triangle, same}});
  });
  std::ranges::stable_sort(links, {}, &Link::from);
  Neighbourhood result;
  result.begin.assign(mesh.triangles.size() + 1, 0);
  for (const Link& link : links) {
    ++result.begin[link.from + 1];
    result.neighbours.push_back(link.to);
  }
  for (std::size_t i = 1; i < result.begin.size(); ++i) result.begin[i] += result.begin[i - 1];
  return result;
}

struct PatchFace {
  std::uint32_t triangle;
  bool flipped;  // against the file, to agree with the patch's first face
};

// The faces that hang together with `seed`, with the flips that make them consistent.
std::vector<PatchFace> grow_patch(std::uint32_t seed, const Neighbourhood& mesh, std::vector<std::uint8_t>& seen) {
  std::vector<PatchFace> patch{{seed, false}};
  seen[seed] = 1;
  for (std::size_t next = 0; next < patch.size(); ++next) {
    const PatchFace face = patch[next];
    for (std::uint32_t i = mesh.begin[face.triangle]; i < mesh.begin[face.triangle + 1]; ++i) {
      const Neighbour& neighbour = mesh.neighbours[i];
      if (seen[neighbour.triangle] != 0) continue;
      seen[neighbour.triangle] = 1;
      patch.push_back({neighbour.triangle, neighbour.same_winding == face.flipped});
    }
  }
  return patch;
}

// Whether the patch must be turned over after its faces were made consistent.
bool must_turn(const std::vector<PatchFace>& patch, const TriangleMesh& mesh,
               const std::vector<FaceVisibility>& visibility) {
  double front = 0.0, back = 0.0, as_in_file = 0.0, against_file = 0.0;
  for (const PatchFace& face : patch) {
    const double area = area_of(mesh, face.triangle);
    const FaceVisibility& sees = visibility[face.triangle];
    front += area * static_cast<double>(face.flipped ? sees.back : sees.front);
    back += area * static_cast<double>(face.flipped ? sees.front : sees.back);
    (face.flipped ? against_file : as_in_file) += area;
  }
  const bool both_sides_see = std::min(front, back) >= kOpenShellShare * std::max(front, back);
  const bool file_is_clear = std::max(as_in_file, against_file) >= kClearMajority * (as_in_file + against_file);
  if (both_sides_see && file_is_clear) return against_file > as_in_file;
  if (front == back) return against_file > as_in_file;
  return back > front;
}

std::size_t turn_outwards(TriangleMesh& mesh, const std::vector<FaceVisibility>& visibility) {
  const Neighbourhood neighbours = manifold_neighbours(mesh);
  std::vector<std::uint8_t> seen(mesh.triangles.size(), 0);
  std::size_t flipped = 0;
  for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (seen[seed] != 0) continue;
    const std::vector<PatchFace> patch = grow_patch(seed, neighbours, seen);
    const bool turn = must_turn(patch, mesh, visibility);
    for (const PatchFace& face : patch) {
      if (face.flipped == turn) continue;
      std::swap(mesh.triangles[face.triangle][1], mesh.triangles[face.triangle][2]);
      ++flipped;
    }
  }
  return flipped;
}

}  // namespace

OuterSkin outer_skin(const TriangleMesh& mesh, const std::vector<FaceVisibility>& visibility, bool keep_inner) {
  std::vector<std::uint8_t> keep(mesh.triangles.size(), 1);
  if (!keep_inner) {
    for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = visibility[i].is_visible && !visibility[i].is_dim ? 1 : 0;
    keep_bores_and_pinholes(mesh, visibility, keep);
    for (std::size_t i = 0; i < keep.size(); ++i) {
      if (visibility[i].is_visible) keep[i] = 1;
    }
  }
  OuterSkin skin;
  std::vector<FaceVisibility> kept_visibility;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] != 0) {
      kept_visibility.push_back(visibility[i]);
    } else {
      skin.inner_area += area_of(mesh, i);
      ++skin.inner_dropped;
    }
  }
  skin.mesh = subset(mesh, keep);
  skin.flipped = turn_outwards(skin.mesh, kept_visibility);
  return skin;
}

}  // namespace asbuilt::model
