// SPDX-License-Identifier: Apache-2.0
#include "peer.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <utility>

#include "asbuilt/model/sample_normals.h"

namespace asbuilt::bench {
namespace {

Result<void> run_open_cases(const Selection& selection, const Peer& peer) {
  const Context context(selection.threads);
  const auto judge_for = [&](const SuitePart& part) { return peer.judge_for(part, peer, selection, context); };
  return run_cases(selection, fmt::format("{} {:g}", peer.name, peer.sampling_ratio), judge_for, context);
}

}  // namespace

int run_peer(int argc, char** argv, Peer peer) {
  Selection selection;
  CLI::App app("The scans of the detection suite through " + peer.title);
  add_options(app, selection);
  app.add_option("--sampling", peer.sampling_ratio, "relative sampling step of the model")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::string message;
  try {
    const auto done = run_open_cases(selection, peer);
    if (done) return 0;
    message = done.error().message;
  } catch (const std::exception& error) {
    message = error.what();
  }
  fmt::print(stderr, "{}: {}\n", argv[0], message);
  return 1;
}

Result<model::PreparedModel> sampled(const SuitePart& part, double sampling_ratio, const Context& context) {
  model::ModelOptions options;
  options.sampling_ratio = sampling_ratio;
  ASBUILT_TRY(model, model::prepare(part.mesh, options, context));
  model.dense_samples.normals =
      model::fitted_normals(model.dense_samples, model.dense_samples, model.sampling_distance, context);
  return std::move(model);
}

Pose model_from_scan_of(const Eigen::Matrix4d& scan_from_model) {
  Pose pose;
  pose.matrix() = scan_from_model;
  return orthonormalised(pose).inverse();
}

}  // namespace asbuilt::bench
