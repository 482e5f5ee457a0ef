// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/detection.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::verify {

/// Largest displacement of the corners of the model's bounding box between two poses, mm: a bound for every vertex.
[[nodiscard]] double displacement_mm(const Pose& a_from_scan, const Pose& b_from_scan,
                                     const model::PreparedModel& model);

/// The candidates by decreasing support, at most `most`, each moving the part by more than `least_apart_mm` from every
/// better one: candidates that ran into the same pose count once.
[[nodiscard]] std::vector<Candidate> best_different(std::vector<Candidate> candidates, std::size_t most,
                                                    double least_apart_mm, const model::PreparedModel& model);

/// Decides from refined candidates, best first: accepted, ambiguous or rejected, with the reason and the numbers.
[[nodiscard]] Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model,
                               const VerifyOptions& options);

}  // namespace asbuilt::verify
