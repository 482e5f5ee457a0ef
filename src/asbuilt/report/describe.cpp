// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/describe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asbuilt::report {
namespace {

/// Behind the point, for three significant digits.
int decimals_of(double value) {
  return value == 0.0 ? 3 : std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 6);
}

/// Three significant digits, plain notation.
std::string plain(double value) {
  if (value == 0.0) return "0";
  return fmt::format("{:.{}f}", value, decimals_of(value));
}

std::string range_of(const inspect::Tolerance& tolerance) {
  return fmt::format("{} to {} mm", signed_mm(tolerance.low_mm), signed_mm(tolerance.high_mm));
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

/// The face or box that fails worst.
const inspect::SurfacePart* worst_failure(const inspect::DeviationReport& deviations) {
  const inspect::SurfacePart* worst = nullptr;
  for (const auto* parts : {&deviations.faces, &deviations.boxes}) {
    for (const inspect::SurfacePart& part : *parts) {
      if (part.verdict != inspect::Verdict::fail) continue;
      if (worst == nullptr || part.statistics.in_tolerance < worst->statistics.in_tolerance) worst = &part;
    }
  }
  return worst;
}

}  // namespace

std::string signed_mm(double value) {
  if (value == 0.0) return "0";
  return (value < 0.0 ? "\u2212" : "+") + plain(std::abs(value));
}

PlaceError place_error(const io::ScanRecord& scan, const Eigen::Vector3d& middle) {
  if (!scan.covariance) return {};
  Eigen::Matrix<double, 3, 6> motion;  // of the middle, by the twist
  motion << -cross_matrix(middle), Eigen::Matrix3d::Identity();
  const double position = (motion * *scan.covariance * motion.transpose()).trace();
  const double rotation = scan.covariance->topLeftCorner<3, 3>().trace();
  return {std::sqrt(std::max(0.0, position)), std::sqrt(std::max(0.0, rotation)) * 180.0 / std::numbers::pi};
}

std::optional<LinkResidual> residual_of(const io::RunRecord& record, int a, int b) {
  if (!record.refinement) return std::nullopt;
  LinkResidual residual;
  double squares = 0.0;
  for (const io::RefinementRecord& refinement : *record.refinement) {
    for (const io::EdgeRecord& edge : refinement.edges) {
      if (std::minmax(edge.from, edge.to) != std::minmax(a, b)) continue;
      squares += static_cast<double>(edge.pairs) * edge.rms * edge.rms;
      residual.pairs += edge.pairs;
    }
  }
  if (residual.pairs == 0) return std::nullopt;
  residual.rms_mm = std::sqrt(squares / static_cast<double>(residual.pairs));
  return residual;
}

LinkSummary links_of(const io::RunRecord& record, int scan) {
  LinkSummary summary;
  if (!record.graph) return summary;
  double squares = 0.0, pairs = 0.0;
  for (const io::OverlapRecord& overlap : record.graph->overlaps) {
    if (overlap.a != scan && overlap.b != scan) continue;
    summary.best_overlap = std::max(summary.best_overlap.value_or(0.0), overlap.overlap);
    if (!overlap.linked) continue;
    ++summary.links;
    const auto residual = residual_of(record, overlap.a, overlap.b);
    if (!residual) continue;
    squares += static_cast<double>(residual->pairs) * residual->rms_mm * residual->rms_mm;
    pairs += static_cast<double>(residual->pairs);
  }
  if (pairs > 0.0) summary.residual_mm = std::sqrt(squares / pairs);
  return summary;
}

std::size_t spots_of(const inspect::DeviationReport& deviations, std::size_t scan) {
  return static_cast<std::size_t>(std::ranges::count_if(deviations.spots, [&](const inspect::Spot& spot) {
    return spot.is_scanned() && static_cast<std::size_t>(spot.scan) == scan;
  }));
}

std::string alignment_method(const ReportInput& input) {
  if (input.deviations.alignment.method == inspect::AlignmentMethod::best_fit) return "best fit";
  return input.verb == "inspect" ? "as given" : "as refined";
}

std::string alignment_detail(const ReportInput& input) {
  const inspect::Alignment& alignment = input.deviations.alignment;
  if (alignment.method == inspect::AlignmentMethod::best_fit) {
    const std::string on = alignment.on == "all" ? "the whole model" : alignment.on;
    return fmt::format(
        "best fit of the cloud to {}: one rigid motion, robust, without scale; rms {} mm before, {} mm "
        "after, of the nine tenths that fit best",
        on, plain(alignment.rms_before_mm), plain(alignment.rms_after_mm));
  }
  const auto& refinement = input.record.refinement;
  if (!refinement || refinement->empty()) return "as given: the cloud was taken to be in the model frame";
  return refinement->front().gauge_method == "best_fit"
             ? "best fit of all segments to the CAD: one rigid motion, robust, without scale"
             : "the frame of the fixed scan, as it was detected";
}

std::string verdict_reason(const ReportInput& input) {
  const inspect::DeviationReport& deviations = input.deviations;
  if (!deviations.verdict) return "limits stated with --tolerance would give a verdict";
  switch (*deviations.verdict) {
    case inspect::Verdict::fail: {
      const inspect::SurfacePart* part = worst_failure(deviations);
      return fmt::format("{} is out of tolerance: {} of what was scanned lies within {}, {} is required", part->name,
                         percent(part->statistics.in_tolerance.value_or(0.0)), range_of(*part->tolerance),
                         percent(input.options.required_share));
    }
    case inspect::Verdict::not_scanned:
      return "nothing of the surface was scanned";
    case inspect::Verdict::not_enough_data:
      return fmt::format("what was scanned is within tolerance, but that is {} of the surface; {} is required",
                         percent(deviations.coverage), percent(input.options.minimum_coverage));
    case inspect::Verdict::pass: {
      // A face that nobody judged has not passed, whatever the part as a whole did.
      std::size_t judged = 0, asked = 0;
      for (const auto* parts : {&deviations.faces, &deviations.boxes}) {
        for (const inspect::SurfacePart& part : *parts) {
          asked += part.verdict ? 1 : 0;
          judged += part.verdict == inspect::Verdict::pass ? 1 : 0;
        }
      }
      std::string reason =
          fmt::format("no face is out of tolerance; {} of the surface was scanned", percent(deviations.coverage));
      if (judged < asked) reason += fmt::format(", {} of {} faces too little to be judged", asked - judged, asked);
      return reason;
    }
  }
  return {};
}

std::string summary_of(const ReportInput& input) {
  const inspect::DeviationReport& deviations = input.deviations;
  const auto failing = [](const std::vector<inspect::SurfacePart>& parts) {
    return std::ranges::count(parts, std::optional(inspect::Verdict::fail), &inspect::SurfacePart::verdict);
  };
  std::string text;
  if (deviations.verdict) {
    const auto count = failing(deviations.faces) + failing(deviations.boxes);
    switch (*deviations.verdict) {
      case inspect::Verdict::fail:
        text = fmt::format("The part is out of tolerance: {} of {} faces and boxes {}. ", count,
                           deviations.faces.size() + deviations.boxes.size(), count == 1 ? "fails" : "fail");
        break;
      case inspect::Verdict::pass:
        text = "The part is within tolerance where it was scanned. ";
        break;
      case inspect::Verdict::not_enough_data:
        text = "Too little of the part was scanned to judge it. ";
        break;
      case inspect::Verdict::not_scanned:
        text = "The part was not scanned. ";
        break;
    }
  }
  if (deviations.over_area.count == 0) return text + "No point lies on the surface.";
  const double mean = deviations.over_area.mean, sigma = deviations.over_area.sigma;
  return text +
         fmt::format("{} of the surface was scanned; its mean deviation is {}{} mm, the standard deviation {} mm.",
                     percent(deviations.coverage), mean < 0.0 ? "\u2212" : "+",
                     fmt::format("{:.{}f}", std::abs(mean), decimals_of(sigma)), plain(sigma));
}

}  // namespace asbuilt::report
