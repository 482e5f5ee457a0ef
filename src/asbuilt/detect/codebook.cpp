// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/codebook.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/parallel.h"

namespace asbuilt::detect {
namespace {

constexpr std::size_t kMostSamples = 65535;  // Codebook::Entry::reference

std::uint16_t fraction_of_turn(float angle) {
  const float turns = angle / (2.0F * std::numbers::pi_v<float>);
  return static_cast<std::uint16_t>(static_cast<std::int32_t>(std::lround(turns * 65536.0F)));
}

// A sample counts as seen when nothing stands before it within the part; the ray starts a little off the surface
// because samples of a faceted skin can lie a hair below it.
std::vector<ViewMask> view_masks(const PointCloud& samples, const model::PreparedModel& model, const Context& context) {
  constexpr float kGrazing = 0.1F;
  const double lift = 0.02 * model.sampling_distance;
  std::vector<ViewMask> masks(samples.size());
  parallel_for(context, masks.size(), 16, [&](std::size_t i) {
    const Eigen::Vector3f& normal = samples.normals[i];
    const Eigen::Vector3d start = (samples.positions[i] + static_cast<float>(lift) * normal).cast<double>();
    for (int view = 0; view < ViewMask::kDirections; ++view) {
      const Eigen::Vector3f& direction = ViewMask::directions()[static_cast<std::size_t>(view)];
      if (normal.dot(direction) < kGrazing) continue;
      if (!model.rays->is_blocked(start, direction.cast<double>(), lift, 2.0 * model.diameter)) masks[i].set(view);
    }
  });
  return masks;
}

// Sheets have two sides: what can be seen of a skin's samples from behind is there once more, turned round.
void add_visible_backs(Codebook& book, const model::PreparedModel& model, const Context& context) {
  PointCloud backs = model.samples;
  for (Eigen::Vector3f& normal : backs.normals) normal = -normal;
  const std::vector<ViewMask> masks = view_masks(backs, model, context);
  for (std::size_t i = 0; i < backs.size() && book.samples.size() < kMostSamples; ++i) {
    if (!masks[i].any()) continue;
    book.samples.positions.push_back(backs.positions[i]);
    book.samples.normals.push_back(backs.normals[i]);
    book.seen_from.push_back(masks[i]);
  }
}

double longest_pair(const PointCloud& samples, const Context& context) {
  std::vector<float> longest(samples.size());
  parallel_for(context, samples.size(), 64, [&](std::size_t i) {
    float best = 0.0F;
    for (const Eigen::Vector3f& other : samples.positions) {
      best = std::max(best, (other - samples.positions[i]).squaredNorm());
    }
    longest[i] = best;
  });
  return std::sqrt(static_cast<double>(*std::ranges::max_element(longest)));
}

// Bin of every ordered pair (kNoBin: left out), row by row.
std::vector<std::uint32_t> pair_bins(const Codebook& book, bool needs_joint_view, const Context& context) {
  const std::size_t count = book.samples.size();
  std::vector<std::uint32_t> bins(count * count, Quantisation::kNoBin);
  parallel_for(context, count, 8, [&](std::size_t r) {
    for (std::size_t i = 0; i < count; ++i) {
      if (i == r) continue;
      if (needs_joint_view && !book.seen_from[r].meets(book.seen_from[i])) continue;
      bins[r * count + i] = book.quantisation.bin(point_pair_feature(
          book.samples.positions[r], book.samples.normals[r], book.samples.positions[i], book.samples.normals[i]));
    }
  });
  return bins;
}

void fill_entries(Codebook& book, const std::vector<std::uint32_t>& bins) {
  book.offsets.assign(book.quantisation.bin_count() + 1, 0);
  for (const std::uint32_t bin : bins) {
    if (bin != Quantisation::kNoBin) ++book.offsets[bin + 1];
  }
  for (std::size_t b = 1; b < book.offsets.size(); ++b) book.offsets[b] += book.offsets[b - 1];
  book.entries.resize(book.offsets.back());
  std::vector<std::uint32_t> next(book.offsets.begin(), book.offsets.end() - 1);
  const std::size_t count = book.samples.size();
  for (std::size_t r = 0; r < count; ++r) {
    const Eigen::Matrix3f rotation = book.frames[r].linear().cast<float>();
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t bin = bins[r * count + i];
      if (bin == Quantisation::kNoBin) continue;
      const float angle = angle_in_frame(rotation, book.samples.positions[i] - book.samples.positions[r]);
      book.entries[next[bin]++] = {static_cast<std::uint16_t>(r), fraction_of_turn(angle)};
    }
  }
}

// One pair is one witness: where the model repeats itself, as planes and cylinders do, several entries of a bucket
// would vote for one (m, alpha). Of those with the same reference and nearly the same angle one remains.
void merge_repetitions(Codebook& book, int alpha_bins, const Context& context) {
  const std::size_t bins = book.quantisation.bin_count();
  const auto sector = [&](const Codebook::Entry& entry) {
    return (static_cast<std::uint32_t>(entry.angle) * static_cast<std::uint32_t>(alpha_bins)) >> 16;
  };
  std::vector<std::uint32_t> remaining(bins);
  parallel_for(context, bins, 256, [&](std::size_t b) {
    const auto begin = book.entries.begin() + book.offsets[b], end = book.entries.begin() + book.offsets[b + 1];
    std::sort(begin, end, [](const Codebook::Entry& x, const Codebook::Entry& y) {
      return x.reference != y.reference ? x.reference < y.reference : x.angle < y.angle;
    });
    const auto last = std::unique(begin, end, [&](const Codebook::Entry& x, const Codebook::Entry& y) {
      return x.reference == y.reference && sector(x) == sector(y);
    });
    remaining[b] = static_cast<std::uint32_t>(last - begin);
  });
  std::uint32_t next = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    const auto begin = book.entries.begin() + book.offsets[b];
    std::copy(begin, begin + remaining[b], book.entries.begin() + next);
    book.offsets[b] = next;
    next += remaining[b];
  }
  book.offsets[bins] = next;
  book.entries.resize(next);
  book.entries.shrink_to_fit();
}

// With 1 / N_b a handful of rare features, as likely clutter as part, outvotes everything else; see docs/detect.md.
std::vector<float> bucket_weights(const Codebook& book, double exponent) {
  std::vector<float> weights(book.quantisation.bin_count(), 0.0F);
  for (std::uint32_t bin = 0; bin < weights.size(); ++bin) {
    const std::size_t size = book.bucket(bin).size();
    if (size > 0) weights[bin] = static_cast<float>(std::pow(static_cast<double>(size), -exponent));
  }
  return weights;
}

}  // namespace

const std::array<Eigen::Vector3f, ViewMask::kDirections>& ViewMask::directions() {
  static const auto spread = [] {
    std::array<Eigen::Vector3f, kDirections> result;
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < kDirections; ++i) {
      const double z = 1.0 - 2.0 * (i + 0.5) / kDirections;
      const double radius = std::sqrt(1.0 - z * z);
      result[static_cast<std::size_t>(i)] =
          Eigen::Vector3d(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z).cast<float>();
    }
    return result;
  }();
  return spread;
}

int ViewMask::nearest_direction(const Eigen::Vector3f& towards_sensor) {
  int best = 0;
  float best_cosine = -2.0F;
  for (int i = 0; i < kDirections; ++i) {
    const float cosine = directions()[static_cast<std::size_t>(i)].dot(towards_sensor);
    if (cosine > best_cosine) {
      best_cosine = cosine;
      best = i;
    }
  }
  return best;
}

Result<std::shared_ptr<const Codebook>> build_codebook(const model::PreparedModel& model, const DetectOptions& options,
                                                       const Context& context) {
  ASBUILT_CHECK(options.validate());
  const std::size_t count = model.samples.size();
  if (count < 3 || count > kMostSamples) {
    return fail(ErrorCode::not_possible,
                fmt::format("the model has {} samples at {} mm, detection needs 3 to {}: choose another sampling_ratio",
                            count, model.sampling_distance, kMostSamples));
  }
  auto book = std::make_shared<Codebook>();
  book->samples = model.samples;
  book->diameter = model.diameter;
  book->sampling_distance = model.sampling_distance;
  book->longest_pair = longest_pair(model.samples, context);
  for (const Eigen::Vector3f& position : model.samples.positions) book->centre += position.cast<double>();
  book->centre /= static_cast<double>(count);
  if (!options.paper_mode) {  // for the backs of sheets, too
    book->seen_from = view_masks(model.samples, model, context);
    if (model.is_open()) add_visible_backs(*book, model, context);
  }
  for (std::size_t i = 0; i < book->samples.size(); ++i) {
    book->frames.push_back(local_frame(book->samples.positions[i], book->samples.normals[i]));
  }

  book->quantisation.distance_step = static_cast<float>(options.distance_bin_ratio * model.sampling_distance);
  book->quantisation.angle_bins = options.angle_bins;
  book->quantisation.distance_bins =
      static_cast<int>(book->longest_pair / static_cast<double>(book->quantisation.distance_step)) + 1;
  fill_entries(*book, pair_bins(*book, options.joint_visibility && !book->seen_from.empty(), context));
  if (options.single_votes) merge_repetitions(*book, options.alpha_bins, context);
  book->bucket_weight = bucket_weights(*book, options.bucket_weight_exponent);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while building the codebook");
  book->largest_voting_bucket =
      options.paper_mode
          ? static_cast<std::uint32_t>(book->entries.size())
          : static_cast<std::uint32_t>(options.bucket_cap * static_cast<double>(book->samples.size())) + 1;
  return std::shared_ptr<const Codebook>(std::move(book));
}

}  // namespace asbuilt::detect
