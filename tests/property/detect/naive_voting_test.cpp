// SPDX-License-Identifier: Apache-2.0
// Eq. 7-10 once more, as slowly and plainly as they are written: maps in place of arrays, doubles for angles.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "asbuilt/detect/codebook.h"
#include "asbuilt/detect/voting.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::detect {
namespace {

using Bin = std::array<int, 4>;
using Cell = std::pair<std::size_t, int>;  // model sample, alpha bin

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Bounds of V(m, alpha): an angle within rounding of a border between two alpha bins may fall into either.
struct Bounds {
  double low = 0.0, high = 0.0;
};

class NaiveVoting {
 public:
  NaiveVoting(const PointCloud& model, double distance_step, const DetectOptions& options)
      : model_(model), step_(static_cast<float>(distance_step)), options_(options) {
    for (std::size_t r = 0; r < model.size(); ++r) {
      for (std::size_t i = 0; i < model.size(); ++i) {
        if (i == r) continue;
        book_[own_bin(feature(model, r, i))].emplace_back(r, angle(model, r, i));
        longest_ = std::max(longest_, (model.positions[i] - model.positions[r]).norm());
      }
    }
  }

  /// V_r of Eq. 9 for one scene reference point.
  [[nodiscard]] std::map<Cell, Bounds> votes(const PointCloud& scene, std::size_t reference) const {
    std::map<Cell, Bounds> space;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      const float distance = (scene.positions[i] - scene.positions[reference]).norm();
      if (i == reference || distance > longest_ + 0.5F * step_) continue;
      const double scene_angle = angle(scene, reference, i);
      for (const Bin& bin : nearest_bins(feature(scene, reference, i))) {  // Eq. 8, p(f_k | f) = 1 / K
        const auto bucket = book_.find(bin);
        if (bucket == book_.end()) continue;
        const double vote = 1.0 / options_.neighbour_bins / static_cast<double>(bucket->second.size());
        for (const auto& [sample, model_angle] : bucket->second) add(space, sample, scene_angle - model_angle, vote);
      }
    }
    return space;
  }

 private:
  static PointPairFeature feature(const PointCloud& cloud, std::size_t i, std::size_t j) {
    return point_pair_feature(cloud.positions[i], cloud.normals[i], cloud.positions[j], cloud.normals[j]);
  }

  // Rotation of the pair about the reference normal, in the frame that the smallest rotation n -> x gives (Rodrigues).
  static double angle(const PointCloud& cloud, std::size_t reference, std::size_t other) {
    const Eigen::Vector3d n = cloud.normals[reference].cast<double>();
    const Eigen::Vector3d d = (cloud.positions[other] - cloud.positions[reference]).cast<double>();
    const Eigen::Vector3d v = n.cross(Eigen::Vector3d::UnitX());
    const Eigen::Vector3d turned = d + v.cross(d) + v.cross(v.cross(d)) / (1.0 + n.x());
    return std::atan2(turned.z(), turned.y());
  }

  [[nodiscard]] std::array<float, 4> in_bins(const PointPairFeature& f) const {
    const float per_angle = static_cast<float>(options_.angle_bins) / std::numbers::pi_v<float>;
    return {f.distance / step_, f.angle_i_d * per_angle, f.angle_j_d * per_angle, f.angle_i_j * per_angle};
  }

  [[nodiscard]] Bin own_bin(const PointPairFeature& f) const {
    Bin bin;
    for (std::size_t k = 0; k < 4; ++k) bin[k] = static_cast<int>(std::floor(in_bins(f)[k]));
    for (std::size_t k = 1; k < 4; ++k) bin[k] = std::min(bin[k], options_.angle_bins - 1);  // an angle of pi
    return bin;
  }

  // All 81 bins around, by the sum of the ways to the borders that lie between; the K first that can exist.
  [[nodiscard]] std::vector<Bin> nearest_bins(const PointPairFeature& f) const {
    const auto value = in_bins(f);
    const Bin own = own_bin(f);
    const int distance_bins = static_cast<int>(longest_ / step_) + 1;
    std::multimap<double, Bin> ranked;
    for (int code = 0; code < 81; ++code) {
      const Bin offset{code % 3 - 1, code / 3 % 3 - 1, code / 9 % 3 - 1, code / 27 - 1};
      Bin bin;
      double way = 0.0;
      bool exists = true;
      for (std::size_t k = 0; k < 4; ++k) {
        bin[k] = own[k] + offset[k];
        const double share = static_cast<double>(value[k]) - own[k];
        const double to_border = offset[k] < 0 ? share : offset[k] > 0 ? 1.0 - share : 0.0;
        exists = exists && bin[k] >= 0 && bin[k] < (k == 0 ? distance_bins : options_.angle_bins) && to_border < 0.5;
        way += to_border;
      }
      if (exists) ranked.emplace(way, bin);
    }
    std::vector<Bin> nearest;
    for (const auto& [way, bin] : ranked) {
      if (nearest.size() < static_cast<std::size_t>(options_.neighbour_bins)) nearest.push_back(bin);
    }
    return nearest;
  }

  void add(std::map<Cell, Bounds>& space, std::size_t sample, double alpha, double vote) const {
    constexpr double kRounding = 3e-4;  // two angles stored as 1/65536 of a turn, float frames
    std::set<int> bins;
    for (const double shift : {-kRounding, 0.0, kRounding}) {
      const double share = (alpha + shift) / kTurn;
      bins.insert(static_cast<int>((share - std::floor(share)) * options_.alpha_bins) % options_.alpha_bins);
    }
    for (const int bin : bins) {
      Bounds& bounds = space[{sample, bin}];
      bounds.high += vote;
      if (bins.size() == 1) bounds.low += vote;
    }
  }

  const PointCloud& model_;
  float step_, longest_ = 0.0F;
  DetectOptions options_;
  std::map<Bin, std::vector<std::pair<std::size_t, double>>> book_;
};

// The model moved, a little noise, half of it missing, and stray points. As even as the sampling of a scan: no two
// samples are closer than half the sampling distance.
Scene cluttered_scene(const model::PreparedModel& model, std::uint64_t seed) {
  Random random(seed, "cluttered scene", 0);
  const Pose scan_from_model = test::random_pose(random);
  Scene scene;
  for (std::size_t i = 0; i < model.samples.size(); i += 2) {
    const auto point = test::moved(scan_from_model, {model.samples.positions[i], model.samples.normals[i]});
    scene.samples.positions.push_back(point.position + test::random_vector(random, 0.5));
    scene.samples.normals.push_back((point.normal + test::random_vector(random, 0.05)).normalized());
  }
  const std::size_t count = scene.samples.size();
  const Eigen::Vector3f middle = scan_from_model.translation().cast<float>();
  for (std::size_t i = 0; i < count; ++i) {
    const auto stray = test::random_oriented_point(random);
    const bool is_apart = std::ranges::none_of(scene.samples.positions, [&](const Eigen::Vector3f& other) {
      return (other - middle - stray.position).norm() < static_cast<float>(0.6 * model.sampling_distance);
    });
    if (!is_apart) continue;
    scene.samples.positions.push_back(middle + stray.position);
    scene.samples.normals.push_back(stray.normal);
  }
  return scene;
}

// Turned, so that no normal is -x, for which there is no smallest rotation to x.
model::PreparedModel turned_model() {
  Pose turn = Pose::Identity();
  turn.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  model::ModelOptions options;
  options.sampling_ratio = 0.05;
  return model::prepare(simulate::transformed(test::stepped_block(), turn), options, Context(2)).value();
}

TEST(LocalVoting, CastsTheVotesOfEquations7To9AndFindsTheirMaximum) {
  const model::PreparedModel model = turned_model();
  for (const int neighbour_bins : {2, 4, 7}) {
    DetectOptions options = DetectOptions{}.as_published();
    options.neighbour_bins = neighbour_bins;
    options.peaks_per_reference = 100;  // shows more of the space than its maximum
    options.peak_ratio = 0.0;
    const auto book = build_codebook(model, options, Context(2)).value();
    const NaiveVoting naive(model.samples, model.sampling_distance * options.distance_bin_ratio, options);
    const Scene scene = cluttered_scene(model, static_cast<std::uint64_t>(neighbour_bins));
    LocalVoting voting(*book, scene, options);
    for (const std::uint32_t reference : {0U, 17U, 41U}) {
      const auto space = naive.votes(scene.samples, reference);
      const std::vector<Peak> peaks = voting.vote(reference, 1.0F);
      ASSERT_EQ(peaks.size(), 100U);

      double highest_low = 0.0;
      std::map<std::size_t, Bounds> best_of_sample;
      for (const auto& [cell, bounds] : space) {
        highest_low = std::max(highest_low, bounds.low);
        best_of_sample[cell.first].low = std::max(best_of_sample[cell.first].low, bounds.low);
        best_of_sample[cell.first].high = std::max(best_of_sample[cell.first].high, bounds.high);
      }
      const auto cell_of = [&](const Peak& peak) {
        return Cell(peak.model_sample,
                    static_cast<int>(std::floor(peak.alpha / kTurn * options.alpha_bins)) % options.alpha_bins);
      };
      constexpr double kSumOfFloats = 1e-4;
      for (const Peak& peak : peaks) {
        EXPECT_GE(peak.votes, best_of_sample[peak.model_sample].low * (1.0 - kSumOfFloats));
        EXPECT_LE(peak.votes, best_of_sample[peak.model_sample].high * (1.0 + kSumOfFloats));
        EXPECT_LE(peak.votes, space.at(cell_of(peak)).high * (1.0 + kSumOfFloats));
      }
      // Eq. 10: no cell has more votes than the first peak.
      EXPECT_GE(peaks.front().votes, highest_low * (1.0 - kSumOfFloats));
      EXPECT_TRUE(std::ranges::is_sorted(peaks, std::ranges::greater{}, &Peak::votes));
    }
  }
}

// With all K bins in existence and none empty, a pair gives away one vote in all: sum_k 1/K sum 1/N_b = 1.
TEST(LocalVoting, GivesOnePairOneVoteInAll) {
  const model::PreparedModel model = turned_model();
  DetectOptions options = DetectOptions{}.as_published();
  options.neighbour_bins = 2;
  options.peaks_per_reference = 100;
  options.peak_ratio = 0.0;
  options.alpha_bins = 6;
  const auto book = build_codebook(model, options, Context(2)).value();
  const NaiveVoting naive(model.samples, model.sampling_distance, options);
  int asked = 0;
  for (std::size_t i = 1; i < model.samples.size(); ++i) {
    Scene scene;
    scene.samples.positions = {model.samples.positions[0], model.samples.positions[i]};
    scene.samples.normals = {model.samples.normals[0], model.samples.normals[i]};
    const auto bins =
        book->quantisation.soft_bins(point_pair_feature(scene.samples.positions[0], scene.samples.normals[0],
                                                        scene.samples.positions[1], scene.samples.normals[1]),
                                     2, 0.5F);
    if (bins.count < 2 || book->bucket(bins.bin[0]).empty() || book->bucket(bins.bin[1]).empty()) continue;
    const double total = [&] {
      double sum = 0.0;
      for (const auto& [cell, bounds] : naive.votes(scene.samples, 0)) sum += 0.5 * (bounds.low + bounds.high);
      return sum;
    }();
    EXPECT_NEAR(total, 1.0, 0.35);  // votes at borders are counted between the bounds
    const auto peaks = LocalVoting(*book, scene, options).vote(0, 1.0F);
    double best_cells = 0.0;
    for (const Peak& peak : peaks) best_cells += static_cast<double>(peak.votes);
    EXPECT_LE(best_cells, 1.0 + 1e-4);
    ++asked;
  }
  EXPECT_GT(asked, 50);
}

TEST(LocalVoting, IgnoresPairsLongerThanTheModelsLongest) {
  const model::PreparedModel model = test::small_model();
  for (const bool paper_mode : {false, true}) {
    const DetectOptions options = paper_mode ? DetectOptions{}.as_published() : DetectOptions{};
    const auto book = build_codebook(model, options, Context(2)).value();
    const PointCloud& samples = book->samples;
    std::size_t first = 0, second = 1;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto length = [&](std::size_t a, std::size_t b) {
          return (samples.positions[a] - samples.positions[b]).norm();
        };
        const bool seen_together = paper_mode || book->seen_from[i].meets(book->seen_from[j]);
        if (seen_together && (second >= first || length(i, j) > length(first, second))) first = i, second = j;
      }
    }
    const auto votes_when_stretched = [&](float stretch) {
      Scene scene;
      scene.samples.positions = {
          samples.positions[first],
          samples.positions[first] + stretch * (samples.positions[second] - samples.positions[first])};
      scene.samples.normals = {samples.normals[first], samples.normals[second]};
      return LocalVoting(*book, scene, options).vote(0, 1.0F).size();
    };
    EXPECT_GT(votes_when_stretched(1.0F), 0U);
    const float length = (samples.positions[first] - samples.positions[second]).norm();
    EXPECT_EQ(votes_when_stretched(static_cast<float>(book->longest_pair + 0.51 * book->sampling_distance) / length),
              0U);
    EXPECT_EQ(votes_when_stretched(3.0F), 0U);
  }
}

}  // namespace
}  // namespace asbuilt::detect
