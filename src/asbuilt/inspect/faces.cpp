// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/model/mesh_edges.h"

namespace asbuilt::inspect {
namespace {

constexpr double kSharpDeg = 30.0;
constexpr double kSmallPiece = 0.005;  // of the area
constexpr std::size_t kMostPieces = 100;
constexpr std::size_t kLeastSpots = 3;

FaceMap cad_faces_of(const TriangleMesh& skin, const io::CadFaceNames& cad_names) {
  FaceMap map;
  map.cad_face = skin.cad_faces;
  std::ranges::sort(map.cad_face);
  const auto repeated = std::ranges::unique(map.cad_face);
  map.cad_face.erase(repeated.begin(), repeated.end());
  for (const int face : skin.cad_faces) {
    const auto place = std::ranges::lower_bound(map.cad_face, face);
    map.of_triangle.push_back(static_cast<std::uint32_t>(place - map.cad_face.begin()));
  }
  for (const int face : map.cad_face) map.names.push_back(io::face_label(face, cad_names));
  return map;
}

/// A number per triangle: the smallest triangle of its piece.
std::vector<int> smooth_pieces(const TriangleMesh& skin) {
  const double cosine = std::cos(kSharpDeg * std::numbers::pi / 180.0);
  DisjointSets pieces(static_cast<int>(skin.triangles.size()));
  model::for_each_edge(model::sorted_sides(skin), [&](std::span<const model::EdgeSide> sides) {
    if (sides.size() != 2) return;
    const Eigen::Vector3d a = doubled_area_vector(skin, sides[0].triangle).stableNormalized();
    const Eigen::Vector3d b = doubled_area_vector(skin, sides[1].triangle).stableNormalized();
    if (a.dot(b) > cosine) pieces.unite(static_cast<int>(sides[0].triangle), static_cast<int>(sides[1].triangle));
  });
  std::vector<int> roots(skin.triangles.size());
  for (std::size_t i = 0; i < roots.size(); ++i) roots[i] = pieces.find(static_cast<int>(i));
  return roots;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::fail:
      return "fail";
    case Verdict::not_enough_data:
      return "not enough data";
    case Verdict::not_scanned:
      return "not scanned";
  }
  return {};
}

FaceMap faces_of(const TriangleMesh& skin, const io::CadFaceNames& cad_names) {
  if (!skin.cad_faces.empty()) return cad_faces_of(skin, cad_names);
  const std::vector<int> roots = smooth_pieces(skin);
  std::vector<double> area(roots.size(), 0.0);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    area[static_cast<std::size_t>(roots[i])] += 0.5 * doubled_area_vector(skin, i).norm();
  }
  const double small = kSmallPiece * std::accumulate(area.begin(), area.end(), 0.0);
  std::vector<std::size_t> large;
  bool any_small = false;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (static_cast<std::size_t>(roots[i]) != i) continue;
    if (area[i] >= small) large.push_back(i);
    any_small = any_small || area[i] < small;
  }
  std::ranges::stable_sort(large, std::ranges::greater{}, [&](std::size_t root) { return area[root]; });
  any_small = any_small || large.size() > kMostPieces;
  if (large.size() > kMostPieces) large.resize(kMostPieces);

  FaceMap map;
  std::vector<std::uint32_t> index_of(roots.size(), static_cast<std::uint32_t>(large.size()));
  for (std::size_t k = 0; k < large.size(); ++k) {
    index_of[large[k]] = static_cast<std::uint32_t>(k);
    map.names.push_back(fmt::format("piece {}", k));
  }
  if (any_small) map.names.emplace_back("small pieces");
  map.cad_face.assign(map.names.size(), -1);
  for (const int root : roots) map.of_triangle.push_back(index_of[static_cast<std::size_t>(root)]);
  return map;
}

Verdict verdict_of(const SurfacePart& part, const VerdictRule& rule) {
  if (part.spots_scanned == 0) return Verdict::not_scanned;
  if (part.spots_scanned < kLeastSpots) return Verdict::not_enough_data;
  const double share_out = 1.0 - part.statistics.in_tolerance.value_or(0.0);
  const double spots_out = share_out * static_cast<double>(part.spots_scanned);
  // On a small face the share would let a single spot decide, which may be an edge's; unless all must be within.
  const bool too_few_to_decide = rule.required_share < 1.0 && spots_out < 1.5;
  if (share_out > 1.0 - rule.required_share && !too_few_to_decide) return Verdict::fail;
  return part.coverage() < rule.minimum_coverage ? Verdict::not_enough_data : Verdict::pass;
}

std::optional<Verdict> verdict_of_all(std::span<const SurfacePart> faces, std::span<const SurfacePart> boxes,
                                      double coverage, const VerdictRule& rule) {
  bool any = false, fails = false, scanned = false;
  for (const auto parts : {faces, boxes}) {
    for (const SurfacePart& part : parts) {
      scanned = scanned || part.spots_scanned > 0;
      if (!part.verdict) continue;
      any = true;
      fails = fails || part.verdict == Verdict::fail;
    }
  }
  if (!any) return std::nullopt;
  if (fails) return Verdict::fail;
  if (!scanned) return Verdict::not_scanned;
  return coverage < rule.minimum_coverage ? Verdict::not_enough_data : Verdict::pass;
}

}  // namespace asbuilt::inspect
