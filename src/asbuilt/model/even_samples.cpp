// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::model {
namespace {

constexpr double kMinDistance =
    0.85;  // of the spacing: the median neighbour is then 0.9 away, no gap much wider than 1
constexpr double kCandidatesPerCell = 16.0;  // per square of the spacing; leaves few gaps
constexpr double kMaxCandidates = 4e6;
constexpr float kSameSide = -0.5F;         // cosine: samples on opposite sides of a thin wall do not compete
constexpr double kMaxCellsAcross = 256.0;  // of the diameter, bounds the memory of the grid

struct Candidate {
  Eigen::Vector3f position, normal;
  std::uint64_t rank = 0;  // random: who is considered first
};

// Draws are stratified along the list of triangles, so that each gets its share of the area to within one.
std::vector<Candidate> draw_candidates(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed,
                                       const Context& context) {
  std::vector<double> area_up_to(mesh.triangles.size());
  double total = 0.0;
  for (std::size_t i = 0; i < area_up_to.size(); ++i) area_up_to[i] = total += doubled_area_vector(mesh, i).norm();
  std::vector<Candidate> candidates(count);
  parallel_for(context, count, 1024, [&](std::size_t i) {
    Random random(seed, "even samples", i);
    const double target = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count) * total;
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end() - 1, target);
    const auto triangle = static_cast<std::size_t>(found - area_up_to.begin());
    const Eigen::Vector3i& t = mesh.triangles[triangle];
    const auto at = [&](int k) -> const Eigen::Vector3d& { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    const double root = std::sqrt(random.uniform()), share = random.uniform();
    const Eigen::Vector3d position = at(0) + root * (1.0 - share) * (at(1) - at(0)) + root * share * (at(2) - at(0));
    const Eigen::Vector3d normal = doubled_area_vector(mesh, triangle).stableNormalized();
    candidates[i] = {position.cast<float>(), normal.cast<float>(), random.bits()};
  });
  return candidates;
}

// The accepted points, in a dense grid of cells at least one minimum distance wide, each cell a linked list.
class AcceptedPoints {
 public:
  AcceptedPoints(const Eigen::AlignedBox3d& box, double min_distance, std::size_t capacity)
      : origin_(box.min().cast<float>()),
        squared_distance_(static_cast<float>(min_distance * min_distance)),
        cell_(static_cast<float>(std::max(min_distance, box.diagonal().norm() / kMaxCellsAcross))) {
    size_ = (box.sizes().cast<float>() / cell_).array().floor().cast<int>() + 3;  // one more on either side
    first_.assign(static_cast<std::size_t>(size_.prod()), -1);
    next_.assign(capacity, -1);
  }

  [[nodiscard]] bool has_room_for(const Candidate& candidate, const std::vector<Candidate>& candidates) const {
    const Eigen::Array3i middle = cell_of(candidate.position);
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
          for (int i = first_[index(middle + Eigen::Array3i(x, y, z))]; i >= 0; i = next_[at(i)]) {
            const Candidate& other = candidates[at(i)];
            const bool is_close = (other.position - candidate.position).squaredNorm() < squared_distance_;
            if (is_close && other.normal.dot(candidate.normal) > kSameSide) return false;
          }
        }
      }
    }
    return true;
  }

  void add(std::size_t i, const Candidate& candidate) {
    int& first = first_[index(cell_of(candidate.position))];
    next_[i] = first;
    first = static_cast<int>(i);
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] Eigen::Array3i cell_of(const Eigen::Vector3f& point) const {
    const Eigen::Array3i cell = ((point - origin_) / cell_).array().floor().cast<int>() + 1;
    return cell.max(1).min(size_ - 2);
  }
  [[nodiscard]] std::size_t index(const Eigen::Array3i& cell) const {
    return at((cell.z() * size_.y() + cell.y()) * size_.x() + cell.x());
  }

  Eigen::Vector3f origin_;
  float squared_distance_, cell_;
  Eigen::Array3i size_;
  std::vector<int> first_, next_;
};

}  // namespace

PointCloud even_samples(const TriangleMesh& mesh, double spacing_mm, std::uint64_t seed, const Context& context) {
  ASBUILT_EXPECT(std::isfinite(spacing_mm) && spacing_mm > 0.0, "a positive spacing");
  const double area = surface_area(mesh);
  if (mesh.empty() || !(area > 0.0)) return {};
  const double wanted = std::ceil(kCandidatesPerCell * area / (spacing_mm * spacing_mm)) + 16.0;
  const auto count = static_cast<std::size_t>(std::min(wanted, kMaxCandidates));
  const std::vector<Candidate> candidates = draw_candidates(mesh, count, seed, context);

  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(candidates[i].rank, i); });

  AcceptedPoints accepted(bounding_box(mesh), kMinDistance * spacing_mm, count);
  PointCloud samples;
  for (const std::size_t i : order) {
    if (!accepted.has_room_for(candidates[i], candidates)) continue;
    accepted.add(i, candidates[i]);
    samples.positions.push_back(candidates[i].position);
    samples.normals.push_back(candidates[i].normal);
  }
  return samples;
}

}  // namespace asbuilt::model
