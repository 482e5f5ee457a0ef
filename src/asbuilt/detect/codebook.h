// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/detect/point_pair.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::detect {

/// Directions from which a sample of the model can be seen, out of a fixed even set.
class ViewMask {
 public:
  static constexpr int kDirections = 192;

  /// Unit vectors towards the sensor, evenly spread (Fibonacci sphere).
  [[nodiscard]] static const std::array<Eigen::Vector3f, kDirections>& directions();
  [[nodiscard]] static int nearest_direction(const Eigen::Vector3f& towards_sensor);

  void set(int direction) { words_[word(direction)] |= bit(direction); }
  [[nodiscard]] bool test(int direction) const { return (words_[word(direction)] & bit(direction)) != 0; }
  [[nodiscard]] bool any() const { return (words_[0] | words_[1] | words_[2]) != 0; }
  [[nodiscard]] bool meets(const ViewMask& other) const {
    return ((words_[0] & other.words_[0]) | (words_[1] & other.words_[1]) | (words_[2] & other.words_[2])) != 0;
  }

 private:
  static std::size_t word(int direction) { return static_cast<std::size_t>(direction) / 64; }
  static std::uint64_t bit(int direction) { return std::uint64_t{1} << (static_cast<unsigned>(direction) % 64); }
  std::array<std::uint64_t, 3> words_{};
};

/// The model's point pair features as an inverted file: feature bin -> the (m_r, alpha_m) of its pairs, in one flat
/// array (Sec. 3.1, "Model Description"). Built once per model, then shared by all scans.
struct Codebook {
  /// One pair: reference sample and the angle of the other sample about its normal, as a fraction of a turn in 1/65536
  /// (so that differences wrap around by themselves).
  struct Entry {
    std::uint16_t reference;
    std::uint16_t angle;
  };

  Quantisation quantisation;
  std::vector<std::uint32_t> offsets;  ///< entries of bin b: [offsets[b], offsets[b + 1])
  std::vector<Entry> entries;
  std::vector<float> bucket_weight;         ///< p(m, alpha | f) of bin b: 1 / N_b in the paper (Eq. 8), N_b^-e here
  std::uint32_t largest_voting_bucket = 0;  ///< buckets with more entries say too little to be worth their votes

  PointCloud samples;        ///< the model's samples m; of an open skin also their visible backs (not in paper mode)
  std::vector<Pose> frames;  ///< local frame of each
  std::vector<ViewMask> seen_from;                   ///< empty in paper mode
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the samples; where poses are compared
  double diameter = 0.0, longest_pair = 0.0, sampling_distance = 0.0;

  [[nodiscard]] std::span<const Entry> bucket(std::uint32_t bin) const {
    return {entries.data() + offsets[bin], entries.data() + offsets[bin + 1]};
  }
};

/// Pairs every sample with every other. Beyond the paper (and not in paper mode), pairs that no single viewpoint sees
/// have no place in it (`joint_visibility`). Cost: O(N^2) time and 4 N^2 bytes for N samples.
/// Errors: invalid_argument for options; not_possible for fewer than 3 or more than 65535 samples.
[[nodiscard]] Result<std::shared_ptr<const Codebook>> build_codebook(const model::PreparedModel& model,
                                                                     const DetectOptions& options,
                                                                     const Context& context);

}  // namespace asbuilt::detect
