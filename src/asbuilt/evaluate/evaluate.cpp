// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/evaluate/reconstruction_error.h"
#include "asbuilt/evaluate/surface_error.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/surface_distance.h"

namespace asbuilt::evaluate {
namespace {

constexpr double kFarInSigmas = 6.0;      // from the true surface: no noise, but a flying point, clutter, a wrong pose
constexpr double kReachInSpacings = 3.0;  // a sensor's own samples leave no larger gaps
constexpr const char* kReconstruction = "reconstruction.ply";

using EntriesByName = std::map<std::string, std::vector<std::size_t>>;

// Entries of the record by file name: the placements found in that scan. Two files of one name could not be told apart.
Result<EntriesByName> entries_by_file_name(const io::RunRecord& record) {
  EntriesByName by_name;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const std::string name = std::filesystem::path(record.scans[i].path).filename().string();
    std::vector<std::size_t>& entries = by_name[name];
    const bool is_further = !entries.empty() && record.scans[i].instance > record.scans[entries.back()].instance;
    if (!entries.empty() && !is_further) {
      return fail(ErrorCode::not_possible, fmt::format("the result holds two scans from files named {}", name));
    }
    entries.push_back(i);
  }
  return by_name;
}

bool looked_for_all_placements(const io::RunRecord& record) {
  return std::ranges::any_of(record.options, [](const auto& option) {
    return option.first == "instances" && option.second == io::OptionValue(std::string("all"));
  });
}

// How well the part's points were found in a scan.
struct SegmentFigures {
  double precision = 0.0, recall = 0.0;
};

Result<SegmentFigures> segment_figures(const std::filesystem::path& file, const LabelledPoints& truth,
                                       std::uint8_t label) {
  ASBUILT_TRY(vertices, io::read_ply_vertices(file));
  const auto *x = vertices.find("x"), *y = vertices.find("y"), *z = vertices.find("z"), *part = vertices.find("part");
  if (x == nullptr || y == nullptr || z == nullptr) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: has no columns x, y and z", file.string()));
  }
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3d& point : truth.points_in_scan) {
    points.push_back(point.allFinite() ? Eigen::Vector3f(point.cast<float>()) : Eigen::Vector3f(1e30F, 1e30F, 1e30F));
  }
  const KdTree tree(points);
  std::vector<bool> found(points.size(), false);
  std::size_t claimed = 0, correct = 0;
  for (std::size_t i = 0; i < x->size(); ++i) {
    if (part != nullptr && (*part)[i] == 0.0) continue;  // the margin
    ++claimed;
    const Eigen::Vector3f point = Eigen::Vector3d((*x)[i], (*y)[i], (*z)[i]).cast<float>();
    // The same point, but for what an offset taken off and put back may cost.
    const auto nearest = tree.nearest(point, 1e-3F + 1e-6F * point.norm());
    if (!nearest.found() || truth.labels[nearest.index] != label) continue;
    ++correct;
    found[nearest.index] = true;
  }
  const auto all = std::ranges::count(truth.labels, label), hits = std::ranges::count(found, true);
  return SegmentFigures{claimed == 0 ? 0.0 : static_cast<double>(correct) / static_cast<double>(claimed),
                        all == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(all)};
}

// The part's points of all accepted scans, under our poses and under the true ones, and of all scans that show it.
struct PartPoints {
  std::vector<Eigen::Vector3d> ours, truth;
  std::vector<Eigen::Vector3d> reference;  // all scans, true poses
  std::vector<double> spacings_mm;         // of the part's points, one a scan
};

std::vector<Eigen::Vector3f> part_points(const LabelledPoints& scan, std::uint8_t label) {
  std::vector<Eigen::Vector3f> points_in_scan;
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    const Eigen::Vector3d& point = scan.points_in_scan[i];
    if (scan.labels[i] == label && point.allFinite()) points_in_scan.emplace_back(point.cast<float>());
  }
  return points_in_scan;
}

void append(PartPoints& points, const LabelledPoints& scan, const std::optional<Pose>& ours,
            const TruePlacement& truth) {
  for (std::size_t i = 0; i < scan.labels.size(); ++i) {
    if (scan.labels[i] != truth.label || !scan.points_in_scan[i].allFinite()) continue;
    const Eigen::Vector3d true_point = truth.model_from_scan * scan.points_in_scan[i];
    points.reference.push_back(true_point);
    if (!ours) continue;
    points.ours.push_back(*ours * scan.points_in_scan[i]);
    points.truth.push_back(true_point);
  }
  const double spacing_mm = median_spacing(part_points(scan, truth.label));
  if (spacing_mm > 0.0) points.spacings_mm.push_back(spacing_mm);
}

std::vector<Eigen::Vector3d> moved(const std::vector<Eigen::Vector3d>& points, const Pose& motion) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const Eigen::Vector3d& point : points) result.push_back(motion * point);
  return result;
}

struct AlignedDistance {
  double mean_mm = std::numeric_limits<double>::infinity();
  Pose motion = Pose::Identity();
};

// Mean distance to the surface after the best motion from either start: where the poses put the points, and where the
// motion `towards_truth` does (the two differ when the whole result is off, for example by a symmetry).
AlignedDistance aligned_distance(const std::vector<Eigen::Vector3d>& points, const Pose& towards_truth,
                                 const TriangleMesh& mesh, const model::SurfaceDistance& surface, double noise_mm,
                                 const Context& context) {
  AlignedDistance best;
  for (const Pose& start : {Pose(Pose::Identity()), towards_truth}) {
    const Pose motion = best_motion_onto(points, mesh, surface, noise_mm, start, context);
    const double mean_mm = mean_surface_distance(moved(points, motion), surface, context);
    if (mean_mm < best.mean_mm) best = {mean_mm, motion};
  }
  return best;
}

// The reconstruction's points, moved as the scans were that it is made of.
Result<std::vector<Eigen::Vector3d>> reconstruction_points(const std::filesystem::path& file, const Pose& motion) {
  ASBUILT_TRY(vertices, io::read_ply_vertices(file));
  const auto *x = vertices.find("x"), *y = vertices.find("y"), *z = vertices.find("z");
  if (x == nullptr || y == nullptr || z == nullptr) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: has no columns x, y and z", file.string()));
  }
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < x->size(); ++i) points.emplace_back(motion * Eigen::Vector3d((*x)[i], (*y)[i], (*z)[i]));
  return points;
}

Result<void> judge_reconstruction(Evaluation& evaluation, const PartPoints& points, const std::filesystem::path& file,
                                  const Pose& ours, const Pose& truth, const TriangleMesh& as_built,
                                  const model::SurfaceDistance& surface, const Context& context) {
  ASBUILT_TRY(cloud, reconstruction_points(file, ours));
  evaluation.reconstruction_distance_mm = mean_surface_distance(cloud, surface, context);
  if (evaluation.noise_sigma_mm > 0.0) {
    const double far_mm = kFarInSigmas * evaluation.noise_sigma_mm;
    const PointsBeyond beyond = points_beyond(cloud, far_mm, surface, context);
    evaluation.reconstruction_points = beyond.points;
    evaluation.reconstruction_beyond = beyond.beyond;
    evaluation.reconstruction_beyond_share = beyond.share();
    evaluation.oracle_beyond_share = points_beyond(moved(points.truth, truth), far_mm, surface, context).share();
  }
  if (points.spacings_mm.empty()) return {};
  evaluation.reconstruction_completeness =
      completeness(cloud, moved(points.reference, truth), kReachInSpacings * median_of(points.spacings_mm), as_built,
                   surface, context);
  return {};
}

Result<void> judge_accuracy(Evaluation& evaluation, const PartPoints& points, const TriangleMesh& as_built,
                            const std::filesystem::path& reconstruction, const Context& context) {
  evaluation.part_points = points.ours.size();
  if (points.ours.size() < 6) return {};
  const double sigma = evaluation.noise_sigma_mm;
  const double noise_mm = sigma > 0.0 ? sigma : 1e-5 * evaluation.diameter_mm;
  const Pose true_from_ours = best_rigid_motion(points.ours, points.truth);
  const model::SurfaceDistance surface(as_built);
  const AlignedDistance ours = aligned_distance(points.ours, true_from_ours, as_built, surface, noise_mm, context);
  const AlignedDistance truth = aligned_distance(points.truth, Pose::Identity(), as_built, surface, noise_mm, context);
  evaluation.mean_distance_mm = ours.mean_mm;
  evaluation.oracle_distance_mm = truth.mean_mm;
  if (*evaluation.oracle_distance_mm > 0.0) {
    evaluation.ratio_to_oracle = *evaluation.mean_distance_mm / *evaluation.oracle_distance_mm;
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < points.ours.size(); ++i) {
    squares += (true_from_ours * points.ours[i] - points.truth[i]).squaredNorm();
  }
  evaluation.relative_pose_error_mm = std::sqrt(squares / static_cast<double>(points.ours.size()));
  if (sigma > 0.0) evaluation.relative_pose_error_sigma = *evaluation.relative_pose_error_mm / sigma;
  if (std::error_code ignored; !std::filesystem::exists(reconstruction, ignored)) return {};
  return judge_reconstruction(evaluation, points, reconstruction, ours.motion, truth.motion, as_built, surface,
                              context);
}

// The part, and the symmetry by which its poses are judged: that of the truth if it names one, else found when a pose
// first asks for it.
class Part {
 public:
  Part(const TriangleMesh& mesh, const std::vector<Pose>& symmetries, double tolerance_mm, const Context& context)
      : mesh_(mesh), symmetries_(symmetries), tolerance_mm_(tolerance_mm), context_(context) {
    context_.progress = {};  // the evaluation has its own
  }

  [[nodiscard]] PoseError error(const Pose& ours, const Pose& truth) {
    const PoseError plain = pose_error(ours, truth, mesh_, symmetries_);
    if (is_right(plain) || !symmetries_.empty()) return plain;
    if (!group_) group_ = found_group();
    if (group_->is_trivial()) return plain;
    const PoseError modulo = pose_error(ours, truth, mesh_, *group_);
    return modulo.max_vertex_mm < plain.max_vertex_mm ? modulo : plain;
  }
  [[nodiscard]] bool is_right(const PoseError& error) const { return error.max_vertex_mm <= tolerance_mm_; }

 private:
  // A mesh that cannot be prepared has no symmetry that anyone could have used.
  [[nodiscard]] model::SymmetryGroup found_group() const {
    const auto prepared = model::prepare(mesh_, {}, context_);
    return prepared ? prepared->symmetry : model::SymmetryGroup{};
  }

  const TriangleMesh& mesh_;
  const std::vector<Pose>& symmetries_;
  double tolerance_mm_;
  Context context_;
  std::optional<model::SymmetryGroup> group_;
};

// A line of the evaluation: what the result says (if anything) of a place where the part stands (if it does).
struct Line {
  std::optional<std::size_t> entry;  // of the record
  std::optional<TruePlacement> placement;
};

// Pairs the entries of a scan with its true placements, the least displaced first; each is used once. Entries without
// a pose stand for the placements that are left. Of these further ones count only if they were looked for.
std::vector<Line> paired(const std::vector<std::size_t>& entries, const io::RunRecord& record,
                         const std::vector<TruePlacement>& placements, bool all_placements, Part& part) {
  struct Pair {
    double displacement_mm;
    std::size_t line, placement;
  };
  std::vector<Line> lines;
  std::vector<Pair> pairs;
  for (const std::size_t entry : entries) {
    if (const auto& pose = record.scans[entry].model_from_scan) {
      for (std::size_t p = 0; p < placements.size(); ++p) {
        const PoseError error = part.error(*pose, placements[p].model_from_scan);
        pairs.push_back({error.max_vertex_mm, lines.size(), p});
      }
    }
    lines.push_back({entry, std::nullopt});
  }
  std::ranges::stable_sort(pairs, std::ranges::less{}, &Pair::displacement_mm);
  std::vector<bool> used(placements.size(), false);
  for (const Pair& pair : pairs) {
    if (lines[pair.line].placement || used[pair.placement]) continue;
    lines[pair.line].placement = placements[pair.placement];
    used[pair.placement] = true;
  }
  for (std::size_t p = 0; p < placements.size(); ++p) {
    if (used[p]) continue;
    const auto waiting = std::ranges::find_if(lines, [&](const Line& line) {
      return line.entry && !line.placement && !record.scans[*line.entry].model_from_scan;
    });
    if (waiting != lines.end()) {
      waiting->placement = placements[p];
    } else if (all_placements || lines.empty()) {
      lines.push_back({std::nullopt, placements[p]});
    }
  }
  if (lines.empty()) lines.emplace_back();
  return lines;
}

ScanFigures figures_of(const TrueScan& truth, const Line& line, const io::RunRecord& record, Part& part) {
  ScanFigures figures;
  figures.name = truth.path.filename().string();
  figures.present = line.placement.has_value();
  figures.occlusion = line.placement ? line.placement->occlusion : truth.occlusion;
  figures.hidden = line.placement ? line.placement->hidden : truth.hidden;
  figures.clutter = truth.clutter;
  if (!line.entry) return figures;
  const io::ScanRecord& scan = record.scans[*line.entry];
  figures.status = io::name_of(scan.status);
  figures.accepted = scan.status == io::ScanStatus::accepted && scan.model_from_scan.has_value();
  if (figures.present && scan.model_from_scan) {
    figures.error = part.error(*scan.model_from_scan, line.placement->model_from_scan);
  }
  figures.right = figures.accepted && figures.error && part.is_right(*figures.error);
  return figures;
}

void count(Evaluation& evaluation, double tolerance_mm) {
  for (const ScanFigures& scan : evaluation.per_scan) {
    evaluation.present += scan.present;
    evaluation.accepted += scan.accepted;
    evaluation.right += scan.right;
    evaluation.wrong += scan.accepted && !scan.right;
    evaluation.disconnected_right +=
        scan.status == "disconnected" && scan.error && scan.error->max_vertex_mm <= tolerance_mm;
  }
  const auto share = [](std::size_t part, std::size_t whole) -> std::optional<double> {
    if (whole == 0) return std::nullopt;
    return static_cast<double>(part) / static_cast<double>(whole);
  };
  evaluation.recall = share(evaluation.right, evaluation.present);
  evaluation.precision = share(evaluation.right, evaluation.accepted);
}

}  // namespace

Result<void> EvaluateOptions::validate() const {
  if (right_ratio > 0.0 && right_ratio < 1.0) return {};
  return fail(ErrorCode::invalid_argument, fmt::format("right_ratio is {}, but must lie between 0 and 1", right_ratio));
}

Result<Evaluation> evaluate(const Truth& truth, const io::RunRecord& record, const std::filesystem::path& result_folder,
                            const EvaluateOptions& options, const Context& context) {
  ASBUILT_CHECK(options.validate());
  ASBUILT_TRY(by_name, entries_by_file_name(record));
  ASBUILT_TRY(model, io::read_mesh(truth.folder / truth.model, io::Unit::millimetre));
  ASBUILT_TRY(as_built, io::read_mesh(truth.folder / truth.as_built, io::Unit::millimetre));

  Evaluation evaluation;
  evaluation.diameter_mm = diameter(model);
  evaluation.noise_sigma_mm = truth.noise_sigma_mm;
  evaluation.scans = truth.scans.size();
  const double tolerance_mm = options.right_ratio * evaluation.diameter_mm;
  const bool all_placements = looked_for_all_placements(record);
  Part part(model, truth.symmetries, tolerance_mm, context);
  PartPoints points;
  std::size_t known = 0, done = 0;
  for (const TrueScan& scan : truth.scans) {
    if (context.cancelled()) return fail(ErrorCode::cancelled, "the evaluation was cancelled");
    const std::vector<std::size_t>& entries = by_name[scan.path.filename().string()];
    known += !entries.empty();
    const auto lines = paired(entries, record, scan.placements(), all_placements, part);
    std::optional<LabelledPoints> labelled;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      ScanFigures figures = figures_of(scan, lines[i], record, part);
      if (i > 0) figures.name += fmt::format("#{}", i + 1);
      if (figures.present && !scan.labels.empty()) {
        if (!labelled) {
          ASBUILT_TRY(read, read_labelled_points(truth, scan));
          labelled = std::move(read);
        }
        const std::optional<Pose> pose =
            figures.accepted ? record.scans[*lines[i].entry].model_from_scan : std::nullopt;
        append(points, *labelled, pose, *lines[i].placement);
      }
      if (figures.error && labelled) {
        const io::ScanRecord& ours = record.scans[*lines[i].entry];
        const std::filesystem::path segment = result_folder / io::segment_file(*lines[i].entry, ours.name);
        if (std::error_code ignored; ours.has_segment() && std::filesystem::exists(segment, ignored)) {
          ASBUILT_TRY(segmentation, segment_figures(segment, *labelled, lines[i].placement->label));
          figures.segment_precision = segmentation.precision;
          figures.segment_recall = segmentation.recall;
        }
      }
      evaluation.per_scan.push_back(std::move(figures));
    }
    context.report_progress(0.7 * static_cast<double>(++done) / static_cast<double>(truth.scans.size()));
  }
  if (known == 0 && !truth.scans.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("none of the {} scans of the truth is in the result; scans are matched by file name, the "
                            "first is {}",
                            truth.scans.size(), truth.scans.front().path.filename().string()));
  }
  count(evaluation, tolerance_mm);
  ASBUILT_CHECK(judge_accuracy(evaluation, points, as_built, result_folder / kReconstruction, context));
  context.report_progress(1.0);
  return evaluation;
}

Result<Evaluation> evaluate(const std::filesystem::path& truth_path, const std::filesystem::path& result_folder,
                            const EvaluateOptions& options, const Context& context) {
  ASBUILT_TRY(truth, read_truth(truth_path));
  ASBUILT_TRY(record, io::read_run_record(result_folder / "result.json"));
  return evaluate(truth, record, result_folder, options, context);
}

}  // namespace asbuilt::evaluate
