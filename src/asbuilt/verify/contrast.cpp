// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/contrast.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "asbuilt/verify/sensor_in_model.h"

namespace asbuilt::verify {
namespace {

constexpr double kClearlyNearer = 0.5;  // of the distance that counts as on the model

// Of samples much denser than the measurements a part is as telling as all of them: they are in an order in which any
// first few are spread out.
struct Draw {
  Draw(const model::PreparedModel& model, double spacing_mm, std::size_t most_samples) {
    constexpr double kSamplesPerMeasurement = 3.0;
    constexpr std::size_t kFewest = 5000;
    const std::size_t all = model.dense_samples.size();
    weight = measurements_per_sample(model, spacing_mm);
    asked = std::clamp(static_cast<std::size_t>(kSamplesPerMeasurement * weight * static_cast<double>(all)),
                       std::min(kFewest, all), all);
    asked = std::min(asked, most_samples);
    weight = std::min(1.0, weight * static_cast<double>(all) / static_cast<double>(asked));
  }

  double weight = 1.0;  // of a sample, in measurements
  std::size_t asked = 0;
};

// Where a part stands, as inner loops want it.
struct Placement {
  Placement(const SizedPose& pose, scan::Viewpoint viewpoint)
      : sized(pose),
        scan_from_model(pose.scan_from_model()),
        model_from_scan(scan_from_model.inverse()),
        directions(pose.model_from_scan.inverse()),
        sensor(as_of_design(viewpoint), pose.model_from_scan) {}

  // Samples are those of the design, so the sensor of a scaled copy is moved to where it sees them as it sees the copy.
  [[nodiscard]] scan::Viewpoint as_of_design(scan::Viewpoint viewpoint) const {
    if (viewpoint.kind == scan::Viewpoint::Kind::point) viewpoint.value = directions * sized.in_model(viewpoint.value);
    return viewpoint;
  }
  [[nodiscard]] Eigen::Vector3d in_scan(const Eigen::Vector3f& sample) const {
    return scan_from_model * sample.cast<double>();
  }

  SizedPose sized;
  Eigen::Affine3d scan_from_model, model_from_scan;
  Pose directions;
  SensorInModel sensor;
};

// What the scan says about a sample, whoever else claims its place.
struct Answer {
  enum class Kind : std::uint8_t { unasked, nothing, surface, against };
  Kind kind = Kind::unasked;
  KdTree::Neighbour nearest;  // of a surface; without rays, of whatever is not far
};

}  // namespace

class ContrastOf::Implementation {
 public:
  Implementation(const SizedPose& own, const model::PreparedModel& model, const ScanEvidence& scan,
                 const EvidenceOptions& options)
      : model_(model),
        scan_(scan),
        options_(options),
        own_(own, scan.scan.viewpoint),
        answers_(model.dense_samples.size()) {}

  [[nodiscard]] PoseContrast against(const SizedPose& rival_pose, std::size_t most_samples) {
    const double spacing_mm = 0.5 * (spacing_at(own_.sized.model_from_scan, model_, scan_.scan) +
                                     spacing_at(rival_pose.model_from_scan, model_, scan_.scan));
    const Draw draw(model_, spacing_mm, std::min(options_.most_samples, most_samples));
    const Placement rival(rival_pose, scan_.scan.viewpoint);
    PoseContrast result;
    ask_own(rival, draw, result);
    ask_rivals(rival, draw, result);
    return result;
  }

 private:
  // The samples that the placement puts where the rival has nothing.
  void ask_own(const Placement& rival, const Draw& draw, PoseContrast& sum) {
    const Eigen::Affine3f rival_from_own = (rival.model_from_scan * own_.scan_from_model).cast<float>();
    for (std::size_t i = 0; i < draw.asked; ++i) {
      if (answers_[i].kind == Answer::Kind::unasked && is_ruled_out(own_, i)) answers_[i].kind = Answer::Kind::nothing;
      if (answers_[i].kind == Answer::Kind::nothing) continue;
      if (is_on(rival, rival_from_own, i)) continue;
      count(verdict_on(own_answer(i), own_, rival), draw.weight, sum.for_first, sum.for_second);
    }
  }

  void ask_rivals(const Placement& rival, const Draw& draw, PoseContrast& sum) {
    const Eigen::Affine3f own_from_rival = (own_.model_from_scan * rival.scan_from_model).cast<float>();
    const bool may_be_far = !scan_.depth;
    for (std::size_t i = 0; i < draw.asked; ++i) {
      if (is_ruled_out(rival, i)) continue;
      if (may_be_far && is_far_from_all(rival, i)) continue;
      if (is_on(own_, own_from_rival, i)) continue;
      count(verdict_on(answer(rival, i, 0.0), rival, own_), draw.weight, sum.for_second, sum.for_first);
    }
  }

  static void count(double verdict, double weight, double& for_it, double& for_other) {
    (verdict > 0.0 ? for_it : for_other) += std::abs(verdict) * weight;
  }

  // Both predict such a sample.
  [[nodiscard]] bool is_on(const Placement& there, const Eigen::Affine3f& there_from_here, std::size_t i) const {
    const double apart = there.sized.size * distance_at(there_from_here * position(i));
    return apart <= kClearlyNearer * options_.distance_mm;
  }

  // Without rays only points speak. Where there were none around a sample, there are none where it is moved to inside
  // that room either, and that is known without a search.
  [[nodiscard]] bool is_far_from_all(const Placement& rival, std::size_t i) {
    const double moved = (rival.in_scan(position(i)) - own_.in_scan(position(i))).norm();
    const KdTree::Neighbour& nearest = own_answer(i).nearest;
    const double room = nearest.found() ? std::sqrt(static_cast<double>(nearest.squared_distance)) : room_mm();
    constexpr double kRounding = 1.001;
    return room > kRounding * (moved + reach_at(1.0));
  }

  // Most of what cosine_if_seen() would rule out, before the distance field is asked.
  [[nodiscard]] bool is_ruled_out(const Placement& here, std::size_t i) const {
    constexpr auto kLeast = 0.99F * static_cast<float>(kGrazing);  // less, for rounding
    const Eigen::Vector3f& normal = model_.dense_samples.normals[i];
    if (!here.sensor.known() || here.sensor.is_turned(position(i), normal, kLeast)) return false;
    return !(model_.is_open() && here.sensor.is_turned(position(i), -normal, kLeast));
  }

  [[nodiscard]] const Eigen::Vector3f& position(std::size_t i) const { return model_.dense_samples.positions[i]; }
  [[nodiscard]] double distance_at(const Eigen::Vector3f& point_in_model) const {
    return std::abs(static_cast<double>(model_.field->distance_at(point_in_model)));
  }
  [[nodiscard]] double distance_at(const SizedPose& placement, const Eigen::Vector3f& point_in_scan) const {
    return placement.size * distance_at(placement.in_model(point_in_scan.cast<double>()).cast<float>().eval());
  }
  [[nodiscard]] double reach_at(double cosine) const {
    return std::hypot(options_.distance_mm, lateral_at(options_, cosine));
  }
  // Slips are looked for within a quarter of the diameter.
  [[nodiscard]] double room_mm() const { return reach_at(1.0) + 0.25 * model_.diameter; }

  [[nodiscard]] const Answer& own_answer(std::size_t i) {
    Answer& known = answers_[i];
    if (known.kind == Answer::Kind::unasked) known = answer(own_, i, scan_.depth ? 0.0 : room_mm());
    return known;
  }

  // The nearest point counts as a surface within reach; it is looked for up to `room_mm` if that is farther.
  [[nodiscard]] Answer answer(const Placement& here, std::size_t i, double room_mm) const {
    using Kind = Answer::Kind;
    const Eigen::Vector3d point = here.in_scan(position(i));
    const std::optional<double> cosine = cosine_to_sensor(here, point, i);
    if (!cosine) return {Kind::nothing, {}};
    const double reach = reach_at(*cosine);
    const KdTree::Neighbour nearest =
        scan_.foreground_tree.nearest(point.cast<float>(), static_cast<float>(std::max(reach, room_mm)));
    if (nearest.found() && (reach >= room_mm || nearest.squared_distance <= static_cast<float>(reach * reach))) {
      return {Kind::surface, nearest};
    }
    if (!scan_.depth) return {Kind::nothing, nearest};
    using Evidence = scan::DepthImage::Evidence;
    const double tolerance = (options_.distance_mm + options_.lateral_mm) / *cosine;
    const Evidence seen = scan_.depth->evidence(point, tolerance);
    return {seen == Evidence::free || seen == Evidence::near ? Kind::against : Kind::nothing, {}};
  }

  // Without a viewpoint every sample may be visible.
  [[nodiscard]] std::optional<double> cosine_to_sensor(const Placement& here, const Eigen::Vector3d& point_in_scan,
                                                       std::size_t i) const {
    const scan::Viewpoint& viewpoint = scan_.scan.viewpoint;
    if (!viewpoint.known()) return 1.0;
    return cosine_if_seen(here.directions, position(i), model_.dense_samples.normals[i],
                          viewpoint.towards_sensor(point_in_scan), model_);
  }

  // 1 for the placement that puts a sample here, -1 for the other, 0 if the scan does not tell.
  [[nodiscard]] double verdict_on(const Answer& answer, const Placement& here, const Placement& there) const {
    if (answer.kind == Answer::Kind::against) return -1.0;
    if (answer.kind != Answer::Kind::surface) return 0.0;
    const Eigen::Vector3f& measured = scan_.foreground.cloud.positions[answer.nearest.index];
    const double own = distance_at(here.sized, measured), other = distance_at(there.sized, measured);
    if (std::min(own, other) > options_.distance_mm) return 0.0;  // something else, or a deviation
    const double lead = other - own;
    return std::abs(lead) < kClearlyNearer * options_.distance_mm ? 0.0 : std::copysign(1.0, lead);
  }

  const model::PreparedModel& model_;
  const ScanEvidence& scan_;
  EvidenceOptions options_;
  Placement own_;
  std::vector<Answer> answers_;
};

ContrastOf::ContrastOf(const SizedPose& own, const model::PreparedModel& model, const ScanEvidence& scan,
                       const EvidenceOptions& options)
    : implementation_(std::make_unique<Implementation>(own, model, scan, options)) {}
ContrastOf::~ContrastOf() = default;

PoseContrast ContrastOf::against(const SizedPose& rival, std::size_t most_samples) {
  return implementation_->against(rival, most_samples);
}

double measurements_per_sample(const model::PreparedModel& model, double spacing_mm) {
  const double square_mm2 = spacing_mm * spacing_mm;
  return square_mm2 > 0.0 ? std::min(1.0, model.dense_sample_area_mm2 / square_mm2) : 1.0;
}

PoseContrast contrast(const SizedPose& first, const SizedPose& second, const model::PreparedModel& model,
                      const ScanEvidence& scan, const EvidenceOptions& options) {
  return ContrastOf(first, model, scan, options).against(second);
}

}  // namespace asbuilt::verify
