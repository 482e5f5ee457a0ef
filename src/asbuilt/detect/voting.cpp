// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/voting.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace asbuilt::detect {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
constexpr std::size_t kBlock = 256;  // votes whose places are found at a time

std::uint16_t fraction_of_turn(float angle) {
  return static_cast<std::uint16_t>(static_cast<std::int32_t>(std::lround(angle / kTurn * 65536.0F)));
}

}  // namespace

LocalVoting::LocalVoting(const Codebook& codebook, const Scene& scene, const DetectOptions& options)
    : codebook_(codebook),
      scene_(scene),
      options_(options),
      row_shift_(static_cast<unsigned>(std::bit_width(static_cast<unsigned>(options.alpha_bins) - 1U))) {
  votes_.resize(codebook.samples.size() << row_shift_);
}

void LocalVoting::add_pair(const Eigen::Vector3f& reference, const Eigen::Vector3f& reference_normal,
                           const Eigen::Vector3f& other, const Eigen::Vector3f& other_normal, float scene_angle) {
  const PointPairFeature feature = point_pair_feature(reference, reference_normal, other, other_normal);
  const Quantisation::Bins bins =
      codebook_.quantisation.soft_bins(feature, options_.neighbour_bins, static_cast<float>(options_.border_reach));
  if (bins.count == 0) return;
  const std::uint16_t angle = fraction_of_turn(scene_angle);
  // p(f_k | f) = 1 / K: K is what the options say, also where a neighbour does not exist.
  const float feature_weight = 1.0F / static_cast<float>(options_.paper_mode ? options_.neighbour_bins : bins.count);
  for (int k = 0; k < bins.count; ++k) {
    const std::span<const Codebook::Entry> bucket = codebook_.bucket(bins.bin[static_cast<std::size_t>(k)]);
    if (bucket.empty() || bucket.size() > codebook_.largest_voting_bucket) continue;
    const float weight = feature_weight * codebook_.bucket_weight[bins.bin[static_cast<std::size_t>(k)]];
    for (std::size_t begin = 0; begin < bucket.size(); begin += kBlock) {
      add_votes(bucket.subspan(begin, std::min(kBlock, bucket.size() - begin)), angle, weight);
    }
    cast_ += bucket.size();
  }
}

// Two loops: finding the places is arithmetic that the compiler turns into vector instructions; the additions, which
// may meet in one place, have to follow one another.
void LocalVoting::add_votes(std::span<const Codebook::Entry> entries, std::uint16_t angle, float weight) {
  const auto alpha_bins = static_cast<std::uint16_t>(options_.alpha_bins);
  std::array<std::uint32_t, kBlock> places;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto alpha = static_cast<std::uint16_t>(angle - entries[i].angle);
    const auto bin = static_cast<std::uint16_t>((static_cast<std::uint32_t>(alpha) * alpha_bins) >> 16);
    places[i] = (static_cast<std::uint32_t>(entries[i].reference) << row_shift_) + bin;
  }
  float* const votes = votes_.data();
  for (std::size_t i = 0; i < entries.size(); ++i) votes[places[i]] += weight;
}

std::vector<Peak> LocalVoting::vote(std::uint32_t reference, float sign) {
  std::ranges::fill(votes_, 0.0F);
  const Eigen::Vector3f point = scene_.samples.positions[reference];
  const Eigen::Vector3f normal = sign * scene_.samples.normals[reference];
  const Pose frame = local_frame(point, normal);
  const Eigen::Matrix3f rotation = frame.linear().cast<float>();
  // No pair of the part is longer; half a sampling distance is lost to sampling at either end.
  const auto reach = static_cast<float>(codebook_.longest_pair + 0.5 * codebook_.sampling_distance);
  const auto closest = static_cast<float>(0.5 * codebook_.sampling_distance);
  for (std::size_t i = 0; i < scene_.samples.size(); ++i) {
    const Eigen::Vector3f offset = scene_.samples.positions[i] - point;
    const float squared = offset.squaredNorm();
    if (squared > reach * reach || squared < closest * closest) continue;
    const float angle = angle_in_frame(rotation, offset);
    const Eigen::Vector3f& other_normal = scene_.samples.normals[i];
    add_pair(point, normal, scene_.samples.positions[i], other_normal, angle);
    if (!scene_.normals_oriented) add_pair(point, normal, scene_.samples.positions[i], -other_normal, angle);
  }
  return peaks(frame, point);
}

std::vector<Peak> LocalVoting::peaks(const Pose& scene_frame, const Eigen::Vector3f& reference) const {
  const int bins = options_.alpha_bins;
  const bool smooth = options_.smooth_maxima;
  const Eigen::Vector3d towards_sensor = scene_.viewpoint.towards_sensor(reference.cast<double>());
  const bool check_view = options_.visible_maxima && scene_.viewpoint.known() && !codebook_.seen_from.empty();
  const auto count = static_cast<std::size_t>(bins);
  std::vector<float> around(count + 2), values(count);
  std::vector<Peak> best_of_sample;
  for (std::size_t m = 0; m < codebook_.samples.size(); ++m) {
    const float* row = votes_.data() + (m << row_shift_);
    std::copy(row, row + count, values.begin());
    if (smooth) {
      // A true alpha near a border splits its votes over two bins; neighbours are counted at half.
      std::copy(row, row + count, around.begin() + 1);
      around.front() = row[count - 1];
      around.back() = row[0];
      for (std::size_t bin = 0; bin < count; ++bin) values[bin] += 0.5F * (around[bin] + around[bin + 2]);
    }
    const auto best = static_cast<int>(std::ranges::max_element(values) - values.begin());
    const float height = values[static_cast<std::size_t>(best)];
    if (!(height > 0.0F)) continue;
    float shift = 0.0F;
    if (smooth) {
      const float left = values[static_cast<std::size_t>((best + bins - 1) % bins)];
      const float right = values[static_cast<std::size_t>((best + 1) % bins)];
      const float curvature = left - 2.0F * height + right;
      if (curvature < 0.0F) shift = std::clamp(0.5F * (left - right) / curvature, -0.5F, 0.5F);
    }
    const float alpha = (static_cast<float>(best) + 0.5F + shift) * kTurn / static_cast<float>(bins);
    best_of_sample.push_back({static_cast<std::uint32_t>(m), alpha, height});
  }
  // A heap, since only the first few are asked for.
  const auto comes_after = [](const Peak& a, const Peak& b) {
    return a.votes != b.votes ? a.votes < b.votes : a.model_sample > b.model_sample;
  };
  std::ranges::make_heap(best_of_sample, comes_after);

  std::vector<Peak> kept;
  while (!best_of_sample.empty() && kept.size() < static_cast<std::size_t>(options_.peaks_per_reference)) {
    std::ranges::pop_heap(best_of_sample, comes_after);
    const Peak peak = best_of_sample.back();
    best_of_sample.pop_back();
    if (!kept.empty() && peak.votes < static_cast<float>(options_.peak_ratio) * kept.front().votes) break;
    if (check_view) {
      const Pose pose = model_from_scan_of(codebook_.frames[peak.model_sample], scene_frame, peak.alpha);
      const int view = ViewMask::nearest_direction((pose.linear() * towards_sensor).cast<float>());
      if (!codebook_.seen_from[peak.model_sample].test(view)) continue;
    }
    kept.push_back(peak);
  }
  return kept;
}

}  // namespace asbuilt::detect
