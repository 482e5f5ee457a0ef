// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/face_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/model/edge_splitting.h"
#include "asbuilt/model/mesh_edges.h"

namespace asbuilt::model {
namespace {

constexpr double kSpotSpacing = 0.01;  // of the diameter: a face wider than this is probed at several spots
constexpr int kMaxSpots = 2000;
constexpr int kFixedSpots = 4;
constexpr int kFewestSpots = 12;           // before a face counts as hidden
constexpr int kFirstRays = 16;             // always cast, so that the two sides can be compared
constexpr double kLiftOff = 1e-5;          // of the diameter: far above float rounding, far below any wall
constexpr int kEvenRays = 192;             // of a hidden spot and side, even over the hemisphere
constexpr double kEvenShare = 1.0 / 30.0;  // of what the threshold asks: at 0.97 a thousandth of the hemisphere
constexpr int kCoverRays = 16;             // of a hidden spot and side, to learn which body hides it
constexpr double kMostEdge = 0.015;        // of the diameter: longer edges of partly hidden faces are halved
constexpr int kMostRounds = 10;            // a thousandth of the longest edge there can be
constexpr double kGolden1 = 0.7548776662466927, kGolden2 = 0.5698402909980532;  // plastic number: an even sequence

double fraction(double x) { return x - std::floor(x); }

// An even sequence in the unit square that starts at a random place; any beginning of it is spread out.
struct EvenSquare {
  double shift_x, shift_y;

  explicit EvenSquare(Random& random) : shift_x(random.uniform()), shift_y(random.uniform()) {}
  [[nodiscard]] std::array<double, 2> operator()(int i) const {
    return {fraction(shift_x + i * kGolden1), fraction(shift_y + i * kGolden2)};
  }
};

struct Face {
  Eigen::Vector3d corner, first_edge, second_edge, normal, tangent, bitangent;
  double area;

  Face(const TriangleMesh& mesh, std::size_t index) {
    const Eigen::Vector3i& t = mesh.triangles[index];
    corner = mesh.vertices[static_cast<std::size_t>(t[0])];
    first_edge = mesh.vertices[static_cast<std::size_t>(t[1])] - corner;
    second_edge = mesh.vertices[static_cast<std::size_t>(t[2])] - corner;
    const Eigen::Vector3d doubled = first_edge.cross(second_edge);
    area = 0.5 * doubled.norm();
    normal = doubled.stableNormalized();
    tangent = normal.unitOrthogonal();
    bitangent = normal.cross(tangent);
  }

  [[nodiscard]] Eigen::Vector3d spot(std::array<double, 2> square) const {
    const double root = std::sqrt(square[0]);
    return corner + root * (1.0 - square[1]) * first_edge + root * square[1] * second_edge;
  }

  // The centroid, then a spot near each corner: what is covered but for a rim shows there first.
  [[nodiscard]] Eigen::Vector3d fixed_spot(int i) const {
    if (i == 0) return corner + (first_edge + second_edge) / 3.0;
    const double along_first = i == 2 ? 0.9 : 0.05, along_second = i == 3 ? 0.9 : 0.05;
    return corner + along_first * first_edge + along_second * second_edge;
  }

  // Cosine-weighted about the normal, so that the escaping share is the light the spot would receive.
  [[nodiscard]] Eigen::Vector3d direction(std::array<double, 2> square, double side) const {
    const double radius = std::sqrt(square[0]), angle = 2.0 * std::numbers::pi * square[1];
    return radius * std::cos(angle) * tangent + radius * std::sin(angle) * bitangent +
           side * std::sqrt(1.0 - square[0]) * normal;
  }

  // Even over the hemisphere.
  [[nodiscard]] Eigen::Vector3d even_direction(std::array<double, 2> square, double side) const {
    const double radius = std::sqrt(1.0 - square[0] * square[0]), angle = 2.0 * std::numbers::pi * square[1];
    return radius * std::cos(angle) * tangent + radius * std::sin(angle) * bitangent + side * square[0] * normal;
  }
};

struct Tally {
  int cast = 0, escaped = 0;

  [[nodiscard]] float share() const { return cast > 0 ? static_cast<float>(escaped) / static_cast<float>(cast) : 0.0F; }
  void operator+=(const Tally& other) {
    cast += other.cast;
    escaped += other.escaped;
  }
};

// For each triangle the body that it belongs to: what hangs together over edges.
std::vector<int> bodies_of(const TriangleMesh& mesh) {
  DisjointSets linked(static_cast<int>(mesh.triangles.size()));
  for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) {
    for (const EdgeSide& side : faces)
      linked.unite(static_cast<int>(faces[0].triangle), static_cast<int>(side.triangle));
  });
  std::vector<int> bodies(mesh.triangles.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i] = linked.find(static_cast<int>(i));
  return bodies;
}

int at_least_one(double count) { return std::max(1, static_cast<int>(std::ceil(count))); }

class Prober {
 public:
  Prober(const TriangleMesh& mesh, const RayScene& rays, const VisibilityOptions& options)
      : rays_(rays),
        options_(options),
        bodies_(bodies_of(mesh)),
        diameter_(diameter(mesh)),
        escapes_needed_(at_least_one((1.0 - options.occlusion_threshold) * options.rays)),
        even_escapes_needed_(at_least_one((1.0 - options.occlusion_threshold) * kEvenShare * kEvenRays)) {}

  [[nodiscard]] const std::vector<int>& bodies() const { return bodies_; }
  [[nodiscard]] double most_edge_mm() const { return kMostEdge * diameter_; }

  [[nodiscard]] FaceVisibility probe(const Face& face, int body, Random random) const {
    const double spots_across = face.area / std::pow(kSpotSpacing * diameter_, 2);
    const int spots = static_cast<int>(std::clamp(std::ceil(spots_across), 1.0, static_cast<double>(kMaxSpots)));
    const EvenSquare spot_at(random);
    Tally front, back;
    int probed = 0, hidden = 0, covered = 0;
    bool is_visible = false, is_dim = true;
    for (; probed < spots || (!is_visible && probed < kFewestSpots); ++probed) {
      const Eigen::Vector3d spot =
          probed < kFixedSpots ? face.fixed_spot(probed) : face.spot(spot_at(probed - kFixedSpots));
      const EvenSquare square(random);
      Tally here_front, here_back;
      const bool is_plain = probe_spot(face, spot, square, is_visible ? 1 : kFirstRays, here_front, here_back);
      const bool sees = is_plain || sees_a_little(face, spot, square);
      if (!is_visible) front += here_front, back += here_back;
      is_visible = is_visible || sees;
      is_dim = is_dim && !is_plain;
      hidden += sees ? 0 : 1;
      covered += !sees && is_covered(face, spot, square, body) ? 1 : 0;
    }
    const auto share = [&](int count) { return static_cast<float>(count) / static_cast<float>(probed); };
    return {front.share(), back.share(), share(hidden), share(covered), is_visible, is_visible && is_dim};
  }

 private:
  // Whether the spot is visible.
  bool probe_spot(const Face& face, const Eigen::Vector3d& spot, const EvenSquare& square, int fewest_rays,
                  Tally& front, Tally& back) const {
    for (int ray = 0; ray < options_.rays; ++ray) {
      if (ray >= fewest_rays && std::max(front.escaped, back.escaped) >= escapes_needed_) break;
      cast(face, spot, square(ray), 1.0, front);
      cast(face, spot, square(ray), -1.0, back);
    }
    return std::max(front.escaped, back.escaped) >= escapes_needed_;
  }

  // The depth of a bore and what stands in a slit are seen from few directions, mostly at grazing angles, which the
  // cosine hardly tries. A scanner catches some of them.
  [[nodiscard]] bool sees_a_little(const Face& face, const Eigen::Vector3d& spot, const EvenSquare& square) const {
    for (const double side : {1.0, -1.0}) {
      int escaped = 0;
      for (int ray = 0; ray < kEvenRays; ++ray) {
        escaped += escapes(above(face, spot, side), face.even_direction(square(ray), side)) ? 1 : 0;
        if (escaped >= even_escapes_needed_) return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool escapes(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return !rays_.is_blocked(origin, direction, 0.0, std::numeric_limits<double>::infinity());
  }

  [[nodiscard]] Eigen::Vector3d above(const Face& face, const Eigen::Vector3d& spot, double side) const {
    return spot + side * kLiftOff * diameter_ * face.normal;
  }

  void cast(const Face& face, const Eigen::Vector3d& spot, std::array<double, 2> square, double side,
            Tally& tally) const {
    ++tally.cast;
    if (escapes(above(face, spot, side), face.direction(square, side))) ++tally.escaped;
  }

  // Whether what a hidden spot meets on one of its sides is mostly another body.
  [[nodiscard]] bool is_covered(const Face& face, const Eigen::Vector3d& spot, const EvenSquare& square,
                                int body) const {
    for (const double side : {1.0, -1.0}) {
      int foreign = 0;
      for (int ray = 0; ray < kCoverRays; ++ray) {
        const RayScene::Hit hit = rays_.first_hit(above(face, spot, side), face.direction(square(ray), side));
        foreign += hit.found() && bodies_[hit.triangle] != body ? 1 : 0;
      }
      if (2 * foreign > kCoverRays) return true;
    }
    return false;
  }

  const RayScene& rays_;
  const VisibilityOptions& options_;
  std::vector<int> bodies_;
  double diameter_;
  int escapes_needed_, even_escapes_needed_;
};

std::vector<FaceVisibility> probe_all(const TriangleMesh& mesh, const Prober& prober, const Context& context) {
  std::vector<FaceVisibility> result(mesh.triangles.size());
  parallel_for(context, mesh.triangles.size(), 128, [&](std::size_t i) {
    if (context.cancelled()) return;
    result[i] = prober.probe(Face(mesh, i), prober.bodies()[i], Random(0, "ambient occlusion", i));
  });
  return result;
}

}  // namespace

std::vector<FaceVisibility> face_visibility(const TriangleMesh& mesh, const RayScene& rays_against,
                                            const VisibilityOptions& options, const Context& context) {
  return probe_all(mesh, Prober(mesh, rays_against, options), context);
}

SeenMesh split_where_hidden(const TriangleMesh& mesh, const RayScene& rays_against, const VisibilityOptions& options,
                            const Context& context) {
  const Prober prober(mesh, rays_against, options);
  SeenMesh seen{mesh, probe_all(mesh, prober, context)};
  std::vector<int> bodies = prober.bodies();
  for (int round = 0; round < kMostRounds && !context.cancelled(); ++round) {
    std::vector<std::uint8_t> chosen(seen.visibility.size());
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      chosen[i] = seen.visibility[i].is_visible && seen.visibility[i].hidden > 0.0F ? 1 : 0;
    }
    SplitMesh split = split_long_edges(seen.mesh, chosen, prober.most_edge_mm());
    if (split.mesh.triangles.size() == seen.mesh.triangles.size()) break;

    std::vector<FaceVisibility> visibility(split.parents.size());
    std::vector<int> bodies_of_pieces(split.parents.size());
    parallel_for(context, split.parents.size(), 128, [&](std::size_t i) {
      const std::uint32_t parent = split.parents[i];
      bodies_of_pieces[i] = bodies[parent];
      visibility[i] = seen.visibility[parent];
      if (chosen[parent] == 0 || context.cancelled()) return;
      visibility[i] = prober.probe(Face(split.mesh, i), bodies[parent], Random(1, "ambient occlusion", i));
    });
    seen = {std::move(split.mesh), std::move(visibility)};
    bodies = std::move(bodies_of_pieces);
  }
  return seen;
}

}  // namespace asbuilt::model
