// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/face_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"

namespace asbuilt::model {
namespace {

constexpr double kSpotSpacing = 0.01;  // of the diameter: a face wider than this is probed at several spots
constexpr int kMaxSpots = 2000;
constexpr int kFirstRays = 16;     // always cast, so that the two sides can be compared
constexpr double kLiftOff = 1e-5;  // of the diameter: far above float rounding, far below any wall
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

  // Cosine-weighted about the normal, so that the escaping share is the light the spot would receive.
  [[nodiscard]] Eigen::Vector3d direction(std::array<double, 2> square, double side) const {
    const double radius = std::sqrt(square[0]), angle = 2.0 * std::numbers::pi * square[1];
    return radius * std::cos(angle) * tangent + radius * std::sin(angle) * bitangent +
           side * std::sqrt(1.0 - square[0]) * normal;
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

class Prober {
 public:
  Prober(const RayScene& rays, const VisibilityOptions& options, double diameter)
      : rays_(rays),
        options_(options),
        diameter_(diameter),
        escapes_needed_(std::max(1, static_cast<int>(std::ceil((1.0 - options.occlusion_threshold) * options.rays)))) {}

  [[nodiscard]] FaceVisibility probe(const Face& face, Random random) const {
    const double spots_across = face.area / std::pow(kSpotSpacing * diameter_, 2);
    const int spots = static_cast<int>(std::clamp(std::ceil(spots_across), 1.0, static_cast<double>(kMaxSpots)));
    const EvenSquare spot_at(random);
    Tally front, back;
    bool is_visible = false;
    for (int i = 0; i < spots && !is_visible; ++i) {
      const Eigen::Vector3d spot = i == 0 ? face.spot({4.0 / 9.0, 0.5}) : face.spot(spot_at(i));  // centroid first
      is_visible = probe_spot(face, spot, EvenSquare(random), front, back);
    }
    return {front.share(), back.share(), is_visible};
  }

 private:
  bool probe_spot(const Face& face, const Eigen::Vector3d& spot, const EvenSquare& square, Tally& front,
                  Tally& back) const {
    Tally here_front, here_back;
    bool is_visible = false;
    for (int ray = 0; ray < options_.rays && !(is_visible && ray >= kFirstRays); ++ray) {
      cast(face, spot, square(ray), 1.0, here_front);
      cast(face, spot, square(ray), -1.0, here_back);
      is_visible = std::max(here_front.escaped, here_back.escaped) >= escapes_needed_;
    }
    front += here_front;
    back += here_back;
    return is_visible;
  }

  void cast(const Face& face, const Eigen::Vector3d& spot, std::array<double, 2> square, double side,
            Tally& tally) const {
    const Eigen::Vector3d origin = spot + side * kLiftOff * diameter_ * face.normal;
    ++tally.cast;
    if (!rays_.is_blocked(origin, face.direction(square, side), 0.0, std::numeric_limits<double>::infinity())) {
      ++tally.escaped;
    }
  }

  const RayScene& rays_;
  const VisibilityOptions& options_;
  double diameter_;
  int escapes_needed_;
};

}  // namespace

std::vector<FaceVisibility> face_visibility(const TriangleMesh& mesh, const RayScene& rays_against,
                                            const VisibilityOptions& options, const Context& context) {
  std::vector<FaceVisibility> result(mesh.triangles.size());
  const Prober prober(rays_against, options, diameter(mesh));
  parallel_for(context, mesh.triangles.size(), 128, [&](std::size_t i) {
    if (context.cancelled()) return;
    result[i] = prober.probe(Face(mesh, i), Random(0, "ambient occlusion", i));
  });
  return result;
}

}  // namespace asbuilt::model
