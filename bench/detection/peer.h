// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/prepared_model.h"
#include "parts.h"
#include "selection.h"

namespace CLI {
class App;
}

namespace asbuilt::bench {

/// Somebody else's detector, and what a program that runs the suite's scans through it is told.
struct Peer {
  std::string name;   ///< its modes are "NAME SAMPLING"
  std::string title;  ///< what it is, in --help
  double sampling_ratio = 0.05;
  /// Prepares a part at `sampling_ratio`; what it gives back judges the scans of that part.
  std::function<Result<Judge>(const SuitePart&, const Peer&, const Selection&, const Context&)> judge_for;
};

/// The whole program: options of its command line, the open cases, errors to stderr. Gives back the exit code.
[[nodiscard]] int run_peer(int argc, char** argv, Peer peer);

/// The part as we sample it for our own detection at that ratio; the normals of the dense samples, too, are fitted over
/// the sampling distance, as a scan would have them.
[[nodiscard]] Result<model::PreparedModel> sampled(const SuitePart& part, double sampling_ratio,
                                                   const Context& context);

/// A matrix that maps the model to the scan, as detectors tell poses; rounding of its rotation is taken out.
[[nodiscard]] Pose model_from_scan_of(const Eigen::Matrix4d& scan_from_model);

}  // namespace asbuilt::bench
