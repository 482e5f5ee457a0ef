// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/alignment.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/refine/gauge.h"

namespace asbuilt::inspect {
namespace {

constexpr double kReachRatio = 0.05;  // of the diameter: points further off are no part of the fit
constexpr double kTrim = 0.9;         // share of the smallest deviations that the rms is told of

/// The triangles that take part, and those of the skin they are.
Result<std::vector<char>> chosen_triangles(const model::PreparedModel& model, const AlignmentOptions& options) {
  std::vector<char> chosen(model.skin.triangles.size(), 1);
  if (options.faces.empty()) return chosen;
  if (model.skin.cad_faces.empty()) {
    return fail(ErrorCode::invalid_argument,
                "the alignment names CAD faces, but the model is a mesh without faces; align on places instead");
  }
  for (const int face : options.faces) {
    if (std::ranges::find(model.skin.cad_faces, face) != model.skin.cad_faces.end()) continue;
    return fail(ErrorCode::invalid_argument,
                fmt::format("the alignment names face {}, which the model's outer skin has not", face));
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = std::ranges::find(options.faces, model.skin.cad_faces[i]) != options.faces.end() ? 1 : 0;
  }
  return chosen;
}

TriangleMesh submesh(const TriangleMesh& skin, const std::vector<char>& chosen) {
  TriangleMesh mesh;
  mesh.vertices = skin.vertices;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i]) mesh.triangles.push_back(skin.triangles[i]);
  }
  return mesh;
}

/// The points that meet the chosen surface, with normals: their own, or those of the faces they meet.
PointCloud participants(const Measurement& measurement, const Feet& feet, const model::PreparedModel& model,
                        const std::vector<char>& chosen, const AlignmentOptions& options) {
  std::vector<Eigen::Vector3f> places;
  for (const Eigen::Vector3d& place : options.places) places.push_back(place.cast<float>());
  const KdTree tree(places);
  const auto radius = static_cast<float>(options.place_radius_ratio * model.diameter);
  PointCloud points;
  for (std::size_t i = 0; i < measurement.cloud.size(); ++i) {
    if (!chosen[feet.triangles[i]] || !(std::abs(feet.deviation_mm[i]) <= kReachRatio * model.diameter)) continue;
    if (!places.empty() && !tree.nearest(feet.points[i], radius).found()) continue;
    const Eigen::Vector3f& face = model.face_normals[feet.triangles[i]];
    if (measurement.cloud.has_normals() && measurement.cloud.normals[i].dot(face) < 0.0F) continue;
    points.positions.push_back(measurement.cloud.positions[i]);
    points.normals.push_back(face);
  }
  return points;
}

double trimmed_rms(const PointCloud& points, const Pose& pose, const model::SurfaceDistance& surface) {
  constexpr std::size_t kProbes = 5000;
  std::vector<double> squares;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kProbes);
  for (std::size_t i = 0; i < points.size(); i += step) {
    const double distance = surface.nearest(pose * points.positions[i].cast<double>()).signed_distance;
    squares.push_back(distance * distance);
  }
  std::ranges::sort(squares);
  const auto kept = static_cast<std::size_t>(std::ceil(kTrim * static_cast<double>(squares.size())));
  double sum = 0.0;
  for (std::size_t i = 0; i < kept; ++i) sum += squares[i];
  return std::sqrt(sum / static_cast<double>(kept));
}

std::string words_for(const AlignmentOptions& options) {
  if (!options.faces.empty()) return fmt::format("faces {}", fmt::join(options.faces, ", "));
  if (!options.places.empty()) return fmt::format("{} places", options.places.size());
  return "all";
}

}  // namespace

Result<Alignment> aligned(const Measurement& measurement, const Feet& feet, const model::PreparedModel& model,
                          const AlignmentOptions& options, const Context& context) {
  Alignment alignment;
  if (options.method == AlignmentMethod::as_given) return alignment;
  alignment.method = AlignmentMethod::best_fit;
  alignment.on = words_for(options);
  ASBUILT_TRY(chosen, chosen_triangles(model, options));
  refine::View view;
  view.segment_in_scan = participants(measurement, feet, model, chosen, options);
  alignment.points = view.segment_in_scan.size();
  if (view.segment_in_scan.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("no point lies on what the alignment is to be made on ({})", alignment.on));
  }
  // The border of the chosen faces is open; the fit leaves out what is nearest to it.
  const model::SurfaceDistance surface(submesh(model.skin, chosen));
  const std::vector<refine::View> views{std::move(view)};
  const std::vector<Pose> start{Pose::Identity()};
  ASBUILT_TRY(pose, refine::best_fit_gauge(views, start, surface, model.diameter, context));
  alignment.model_from_given = pose;
  alignment.rms_before_mm = trimmed_rms(views[0].segment_in_scan, start[0], surface);
  alignment.rms_after_mm = trimmed_rms(views[0].segment_in_scan, pose, surface);
  return alignment;
}

}  // namespace asbuilt::inspect
