// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
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

/// Whether a rival is nearly as well proven as the best candidate and explains a fair part of what that one does.
/// Clutter that passes the thresholds alone is not a second part beside a clear first.
[[nodiscard]] bool is_comparable(const Candidate& rival, const Candidate& best);

/// Whether the part's centre is at about the same place in both.
[[nodiscard]] bool is_in_one_place(const Candidate& a, const Candidate& b, const model::PreparedModel& model);

/// Whether a rival would be a second placement of the part beside the best candidate: in another place, comparable, and
/// nothing stands against it on its own.
[[nodiscard]] bool is_second_instance(const Candidate& best, const Candidate& rival, const model::PreparedModel& model,
                                      const VerifyOptions& options);
[[nodiscard]] std::string second_instance_sentence(const Candidate& best, const Candidate& rival,
                                                   const model::PreparedModel& model);

/// Decides from refined candidates, best first: accepted, ambiguous or rejected, with the reason and the numbers.
[[nodiscard]] Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model,
                               const VerifyOptions& options);

}  // namespace asbuilt::verify
