// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/evidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/scan/normals.h"

namespace asbuilt::verify {
namespace {

using Evidence = scan::DepthImage::Evidence;

// What returned nothing lies together: behind something too near to be measured, on a dark or shining face. It is one
// witness against a pose, not as many as there are samples, so each counts no more than this.
constexpr double kMissing = 0.25;

double ratio(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

scan::Scan without(const scan::Scan& scan, const std::vector<std::uint8_t>& background) {
  scan::Scan rest;
  rest.viewpoint = scan.viewpoint;
  rest.normals_oriented = scan.normals_oriented;
  rest.spacing_mm = scan.spacing_mm;
  rest.spacing_by_range = scan.spacing_by_range;
  rest.noise_sigma_mm = scan.noise_sigma_mm;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    if (background[i] != 0) continue;
    rest.cloud.positions.push_back(scan.cloud.positions[i]);
    rest.cloud.normals.push_back(scan.cloud.normals[i]);
    rest.surface_variation.push_back(scan.surface_variation[i]);
  }
  return rest;
}

// Without a viewpoint the sensor is taken to be far away, on the side to which the surface points on average: by the
// scan's normals, or, where their signs mean nothing, by those of the model's faces that the points lie on at this
// pose.
Eigen::Vector3d mean_direction(const Pose& model_from_scan, const model::PreparedModel& model, const ScanEvidence& scan,
                               double distance_mm) {
  const Eigen::Vector3d centre = model_from_scan.inverse() * model.box.center().eval();
  std::vector<KdTree::Neighbour> members;
  scan.foreground_tree.within(centre.cast<float>(), static_cast<float>(0.5 * model.diameter), members);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const KdTree::Neighbour& member : members) {
    if (scan.scan.normals_oriented) {
      sum += scan.foreground.cloud.normals[member.index].cast<double>();
      continue;
    }
    const Eigen::Vector3d point = model_from_scan * scan.foreground.cloud.positions[member.index].cast<double>();
    const model::DistanceField::Sample sample = model.field->at(point.cast<float>());
    if (!sample.known() || std::abs(sample.distance) > distance_mm) continue;
    sum += model_from_scan.linear().transpose() *
           model.face_normals[static_cast<std::size_t>(sample.triangle)].cast<double>();
  }
  return sum.norm() > 0.0 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::Zero();
}

class Judge {
 public:
  Judge(const Pose& model_from_scan, const model::PreparedModel& model, const ScanEvidence& scan,
        const EvidenceOptions& options)
      : scan_from_model_(model_from_scan.inverse()), model_(model), scan_(scan), options_(options) {
    centre_ = model.box.center();
    if (!scan.scan.viewpoint.known()) {
      parallel_direction_ = mean_direction(model_from_scan, model, scan, options.distance_mm);
    }
  }

  void add(const Eigen::Vector3f& point_in_model, const Eigen::Vector3f& normal_in_model, PoseEvidence& sum) const {
    ++sum.samples;
    const Eigen::Vector3d point = scan_from_model_ * point_in_model.cast<double>();
    const Eigen::Vector3d normal = scan_from_model_.linear() * normal_in_model.cast<double>();
    const bool is_known = scan_.scan.viewpoint.known();
    const Eigen::Vector3d towards = is_known ? scan_.scan.viewpoint.towards_sensor(point) : parallel_direction_;
    const double incidence = is_known ? normal.dot(towards) : 0.0;
    const KdTree::Neighbour measured = surface_at(point, normal, lateral_at(options_, incidence));
    const bool is_there = measured.found();
    sum.explained_anywhere += is_there ? 1 : 0;
    const std::optional<double> seen =
        cosine_if_seen(scan_from_model_, point_in_model, normal_in_model, towards, model_);
    if (!seen) return;
    const double cosine = *seen;
    sum.facing += cosine;
    ++sum.facing_samples;
    if (is_there) {
      sum.explained += cosine;
      ++sum.explained_samples;
      // A face whose place another surface fills, the wall beside an edge, holds nothing.
      if (!is_turned_alike(measured, normal)) return;
      const Eigen::Vector3d lever = (point_in_model.cast<double>() - centre_) / (0.5 * model_.diameter);
      Vector6d row;
      row << lever.cross(normal_in_model.cast<double>()), normal_in_model.cast<double>();
      sum.information += row * row.transpose();
      const double grown = lever.dot(normal_in_model.cast<double>());
      sum.twist_growth += grown * row;
      sum.growth += grown * grown;
    } else if (!scan_.depth) {
      sum.missing += cosine;
    } else {
      const double tolerance = (options_.distance_mm + options_.lateral_mm) / cosine;
      switch (scan_.depth->evidence(point, tolerance)) {
        case Evidence::near:
          sum.contradicted += cosine;
          break;
        case Evidence::hidden:
          sum.hidden += cosine;
          break;
        case Evidence::free:
          sum.seen_through += cosine;
          break;
        case Evidence::unknown:
          (scan_.field->is_outside(point) ? sum.hidden : sum.missing) += cosine;
          break;
      }
    }
  }

 private:
  // The scan point that shows a sample's surface; none if the surface is not there.
  [[nodiscard]] KdTree::Neighbour surface_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                             double lateral_mm) const {
    const auto reach = static_cast<float>(std::hypot(options_.distance_mm, lateral_mm));
    const KdTree::Neighbour nearest = scan_.foreground_tree.nearest(point.cast<float>(), reach);
    if (!nearest.found()) return nearest;
    const Eigen::Vector3d offset = scan_.foreground.cloud.positions[nearest.index].cast<double>() - point;
    return std::abs(offset.dot(normal)) <= options_.distance_mm ? nearest : KdTree::Neighbour{};
  }

  [[nodiscard]] bool is_turned_alike(const KdTree::Neighbour& measured, const Eigen::Vector3d& normal) const {
    constexpr double kAlike = 0.5;  // cosine; normals of noisy and narrow surfaces are no better known
    const double cosine = scan_.foreground.cloud.normals[measured.index].cast<double>().dot(normal);
    return std::abs(cosine) >= kAlike;
  }

  Pose scan_from_model_;
  const model::PreparedModel& model_;
  const ScanEvidence& scan_;
  const EvidenceOptions& options_;
  Eigen::Vector3d centre_;
  Eigen::Vector3d parallel_direction_ = Eigen::Vector3d::Zero();
};

// n = pi r^2 / s^2 points in radius r give the slope of their plane with 2 sigma / (r sqrt(n)).
double normal_radius_mm(double noise_sigma_mm, double spacing_mm) {
  constexpr double kSlope = 0.1, kLeastInSpacings = 2.5;
  const double wanted = std::sqrt(2.0 / (kSlope * std::sqrt(std::numbers::pi)) * noise_sigma_mm * spacing_mm);
  return std::max(wanted, kLeastInSpacings * spacing_mm);
}

// Whether the model's surface goes on in its tangent plane all around, `radius` far.
bool is_flat(const Eigen::Vector3f& on_surface, const Eigen::Vector3f& normal, float radius,
             const model::PreparedModel& model) {
  constexpr float kSag = 0.25F;  // a cylinder of twice the radius is flat enough
  const Eigen::Vector3f u = radius * normal.unitOrthogonal(), v = normal.cross(u);
  for (const Eigen::Vector3f& step : {u, v, Eigen::Vector3f(-u), Eigen::Vector3f(-v)}) {
    if (!(std::abs(model.field->distance_at(on_surface + step)) <= kSag * radius)) return false;
  }
  return true;
}

// Whether the wall is so thin that a point on it cannot say which of its sides it lies on.
bool is_thin(const Eigen::Vector3f& in_model, const model::DistanceField::Sample& sample, float distance_mm,
             const model::PreparedModel& model) {
  const Eigen::Vector3f& normal = model.face_normals[static_cast<std::size_t>(sample.triangle)];
  return model.field->distance_at(in_model - (sample.distance + 2.0F * distance_mm) * normal) > 0.0F;
}

}  // namespace

ScanEvidence::ScanEvidence(const scan::Scan& the_scan, const std::vector<std::uint8_t>& the_background,
                           const Context& context)
    : scan(the_scan),
      background(the_background),
      foreground(without(the_scan, the_background)),
      foreground_tree(foreground.cloud.positions, context) {
  if (!scan.viewpoint.known()) return;
  depth.emplace(scan.cloud.positions, scan.spacing_mm, scan.viewpoint);
  field.emplace(scan.cloud.positions, scan.spacing_mm, scan.viewpoint);
}

double lateral_at(const EvidenceOptions& options, double cosine) {
  constexpr double kFlat = 0.6;  // cosine
  const double seen = std::abs(cosine);
  if (seen >= kFlat || seen == 0.0) return options.lateral_mm;
  const double apart_mm = options.lateral_mm * kFlat / std::max(seen, kGrazing);
  return std::max(options.lateral_mm, std::min(apart_mm, options.most_lateral_mm));
}

double spacing_at(const Pose& model_from_scan, const model::PreparedModel& model, const scan::Scan& scan) {
  return scan.spacing_at(model_from_scan.inverse() * model.box.center().eval());
}

std::optional<double> cosine_if_seen(const Pose& scan_from_model, const Eigen::Vector3f& point_in_model,
                                     const Eigen::Vector3f& normal_in_model, const Eigen::Vector3d& towards_sensor,
                                     const model::PreparedModel& model) {
  const Eigen::Vector3d normal = normal_in_model.cast<double>();
  const double along = (scan_from_model.linear() * normal).dot(towards_sensor);
  const double side = model.is_open() && along < 0.0 ? -1.0 : 1.0;  // of a sheet, that it may see
  const double cosine = side * along;
  if (cosine < kGrazing) return std::nullopt;
  const double lift = 1e-3 * model.diameter;
  const Eigen::Vector3d start = point_in_model.cast<double>() + side * lift * normal;
  const Eigen::Vector3d towards = scan_from_model.linear().transpose() * towards_sensor;
  if (model.rays->is_blocked(start, towards, lift, 2.0 * model.diameter)) return std::nullopt;
  return cosine;
}

double PoseEvidence::score() const {
  return ratio(static_cast<double>(explained),
               static_cast<double>(explained + contradicted + seen_through) + kMissing * static_cast<double>(missing));
}

double PoseEvidence::weakest_direction() const {
  if (explained_samples == 0) return 0.0;
  return std::max(0.0, SymmetricEigen<6>(information).eigenvalues()[0]) / static_cast<double>(explained_samples);
}

double PoseEvidence::support(double contradiction_weight) const {
  return ratio(explained - contradiction_weight * (contradicted + seen_through) - kMissing * missing,
               static_cast<double>(samples));
}

double PoseEvidence::free_space_share() const { return ratio(seen_through, facing - hidden); }

double PoseEvidence::visible_share() const {
  return ratio(static_cast<double>(explained_anywhere), static_cast<double>(samples));
}

PoseEvidence evidence_for(const Pose& model_from_scan, const PointCloud& samples, const model::PreparedModel& model,
                          const ScanEvidence& scan, const EvidenceOptions& options) {
  const Judge judge(model_from_scan, model, scan, options);
  PoseEvidence sum;
  const std::size_t count = std::min(options.most_samples, samples.size());
  for (std::size_t i = 0; i < count; ++i) judge.add(samples.positions[i], samples.normals[i], sum);
  return sum;
}

double share_within(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                    const model::PreparedModel& model, double distance_mm) {
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const Eigen::Vector3f translation = model_from_scan.translation().cast<float>();
  std::size_t on = 0, within = 0;
  for (const Eigen::Vector3f& point : points_in_scan) {
    const model::DistanceField::Sample sample = model.field->at(rotation * point + translation);
    if (!sample.known()) continue;
    on += std::abs(sample.distance) <= distance_mm ? 1 : 0;
    within += sample.distance < -2.0 * distance_mm ? 1 : 0;
  }
  return ratio(static_cast<double>(within), static_cast<double>(on + within));
}

double share_seen_from_behind(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                              const model::PreparedModel& model, const ScanEvidence& scan,
                              const EvidenceOptions& options) {
  const Eigen::Vector3d towards = mean_direction(model_from_scan, model, scan, options.distance_mm);
  if (towards.isZero(0.0)) return 0.0;
  const double tolerance = options.distance_mm + options.lateral_mm;
  std::vector<Eigen::Vector3d> on_model;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& point : points_in_scan) {
    const Eigen::Vector3d in_scan = point.cast<double>();
    const Eigen::Vector3d in_model = model_from_scan * in_scan;
    if (!(std::abs(model.field->distance_at(in_model.cast<float>())) <= options.distance_mm)) continue;
    on_model.push_back(in_scan);
    centre += in_scan;
  }
  if (on_model.empty()) return 0.0;
  centre /= static_cast<double>(on_model.size());
  const auto hidden_from = [&](const scan::Viewpoint& viewpoint) {
    const scan::DepthImage image(scan.scan.cloud.positions, scan.scan.spacing_mm, viewpoint);
    const auto hidden =
        std::ranges::count_if(on_model, [&](const Eigen::Vector3d& point) { return image.hides(point, tolerance); });
    return ratio(static_cast<double>(hidden), static_cast<double>(on_model.size()));
  };
  // How far away the sensor stood is not known; the share that hides wherever it stood is what speaks against a pose.
  using scan::Viewpoint;
  double least = std::max(
      0.0, hidden_from({Viewpoint::Kind::direction, -towards}) - hidden_from({Viewpoint::Kind::direction, towards}));
  for (const double diameters : {6.0, 3.0, 1.5}) {
    if (least == 0.0) break;
    const Eigen::Vector3d arm = diameters * model.diameter * towards;
    least = std::min(least, std::max(0.0, hidden_from({Viewpoint::Kind::point, centre + arm}) -
                                              hidden_from({Viewpoint::Kind::point, centre - arm})));
  }
  return least;
}

double normal_agreement(const Pose& model_from_scan, const scan::Scan& scan, const model::PreparedModel& model,
                        const NormalOptions& options) {
  const double min_cosine = std::cos(options.max_angle);
  const Eigen::Vector3f centre = (model_from_scan.inverse() * model.box.center().eval()).cast<float>();
  const auto radius = static_cast<float>(0.5 * model.diameter + options.distance_mm);
  std::size_t on_model = 0, agreeing = 0;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    if ((scan.cloud.positions[i] - centre).squaredNorm() > radius * radius) continue;
    const Eigen::Vector3d point = model_from_scan * scan.cloud.positions[i].cast<double>();
    const model::DistanceField::Sample sample = model.field->at(point.cast<float>());
    if (!sample.known() || std::abs(sample.distance) > options.distance_mm) continue;
    const Eigen::Vector3d model_normal = model.face_normals[static_cast<std::size_t>(sample.triangle)].cast<double>();
    const double cosine = model_normal.dot(model_from_scan.linear() * scan.cloud.normals[i].cast<double>());
    ++on_model;
    agreeing += (scan.normals_oriented ? cosine : std::abs(cosine)) >= min_cosine ? 1 : 0;
  }
  return ratio(static_cast<double>(agreeing), static_cast<double>(on_model));
}

std::optional<double> flat_normal_agreement(const Pose& model_from_scan,
                                            std::span<const Eigen::Vector3f> points_in_scan, const ScanEvidence& scan,
                                            const model::PreparedModel& model, const NormalOptions& options) {
  constexpr std::size_t kMost = 600, kFewest = 30, kFewestInFit = 6;
  const double radius = normal_radius_mm(scan.scan.noise_sigma_mm, spacing_at(model_from_scan, model, scan.scan));
  const auto min_cosine = static_cast<float>(std::cos(options.max_angle));
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const Eigen::Vector3f translation = model_from_scan.translation().cast<float>();
  const PointCloud& cloud = scan.foreground.cloud;
  std::vector<KdTree::Neighbour> neighbours;
  std::size_t asked = 0, agreeing = 0;
  for (const Eigen::Vector3f& point : points_in_scan) {
    if (asked == kMost) break;
    const Eigen::Vector3f in_model = rotation * point + translation;
    const model::DistanceField::Sample sample = model.field->at(in_model);
    if (!sample.known() || std::abs(sample.distance) > options.distance_mm) continue;
    const Eigen::Vector3f& model_normal = model.face_normals[static_cast<std::size_t>(sample.triangle)];
    if (!is_flat(in_model - sample.distance * model_normal, model_normal, static_cast<float>(radius), model)) continue;
    scan.foreground_tree.within(point, static_cast<float>(radius), neighbours);
    if (neighbours.size() < kFewestInFit) continue;
    const auto own = std::ranges::min_element(neighbours, {}, &KdTree::Neighbour::squared_distance);
    // The scan's own normal follows curvature but also the noise, the wider fit neither: either may agree.
    const Eigen::Vector3f own_normal = rotation * cloud.normals[own->index];
    const Eigen::Vector3f fitted = rotation * scan::fit_plane(cloud.positions, neighbours).normal;
    const float turn = fitted.dot(own_normal) < 0.0F ? -1.0F : 1.0F;
    // The sheets of an open skin may be seen from behind.
    const bool sign_counts = scan.scan.normals_oriented && !model.is_open() &&
                             !is_thin(in_model, sample, static_cast<float>(options.distance_mm), model);
    const auto agrees = [&](float cosine) { return (sign_counts ? cosine : std::abs(cosine)) >= min_cosine; };
    ++asked;
    agreeing += agrees(turn * model_normal.dot(fitted)) || agrees(model_normal.dot(own_normal)) ? 1 : 0;
  }
  if (asked < kFewest) return std::nullopt;
  return static_cast<double>(agreeing) / static_cast<double>(asked);
}

}  // namespace asbuilt::verify
