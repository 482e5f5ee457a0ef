// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/contrast.h"
#include "asbuilt/verify/detection.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::verify {

/// Largest displacement of the corners of the model's bounding box between two poses, mm: a bound for every vertex.
[[nodiscard]] double displacement_mm(const Pose& a_from_scan, const Pose& b_from_scan,
                                     const model::PreparedModel& model);

/// The same modulo the part's symmetry: 0 for poses that no scan can tell apart.
[[nodiscard]] double displacement_modulo_mm(const Pose& a_from_scan, const Pose& b_from_scan,
                                            const model::PreparedModel& model);

/// The candidates by decreasing support, at most `most`, each moving the part by more than `least_apart_mm` from every
/// better one: candidates that ran into the same pose count once. Modulo the symmetry unless in paper mode.
[[nodiscard]] std::vector<Candidate> best_different(std::vector<Candidate> candidates, std::size_t most,
                                                    double least_apart_mm, const model::PreparedModel& model,
                                                    const VerifyOptions& options);

/// What the scan says where two candidates predict different things.
using Comparison = std::function<PoseContrast(const Candidate& first, const Candidate& second)>;

/// Decides from refined candidates: accepted, ambiguous or rejected, with the reason and the numbers. Rivals in the
/// same place are told apart by `compare`, if it is there, else by their support alone.
[[nodiscard]] Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model,
                               const VerifyOptions& options, const Comparison& compare = {});

}  // namespace asbuilt::verify
