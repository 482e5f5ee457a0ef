// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
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
/// better one: candidates that ran into the same pose count once, with the most votes that any of them had. Modulo the
/// symmetry unless in paper mode.
[[nodiscard]] std::vector<Candidate> best_different(std::vector<Candidate> candidates, std::size_t most,
                                                    double least_apart_mm, const model::PreparedModel& model,
                                                    const VerifyOptions& options);

/// The `weakest_direction` that a candidate needs to be held by the surface that was found: the more, the larger the
/// share of the surface that should be visible and returned nothing, for there nothing can deny the pose.
[[nodiscard]] double hold_needed(double missing_share, const VerifyOptions& options);

/// Whether a rival is nearly as well proven as the best candidate and explains a fair part of what that one does.
/// Clutter that passes the thresholds alone is not a second part beside a clear first.
[[nodiscard]] bool is_comparable(const Candidate& rival, const Candidate& best);

/// Whether the part's centre is at about the same place in both.
[[nodiscard]] bool is_in_one_place(const Candidate& a, const Candidate& b, const model::PreparedModel& model);

/// Whether an accepted pose clears every limit by so much that searching the scan further could not unsettle it.
[[nodiscard]] bool is_beyond_doubt(const Detection& detection, const VerifyOptions& options);

/// Whether a rival would be a second placement of the part beside the best candidate: in another place, comparable, and
/// nothing stands against it on its own.
[[nodiscard]] bool is_second_instance(const Candidate& best, const Candidate& rival, const model::PreparedModel& model,
                                      const VerifyOptions& options);
[[nodiscard]] std::string second_instance_sentence(const Candidate& best, const Candidate& rival,
                                                   const model::PreparedModel& model);

/// What the scan says where two candidates predict different things.
using Comparison = std::function<PoseContrast(const Candidate& first, const Candidate& second)>;

/// Of candidates that count as one and that only edges hold, support hardly tells which stands best: most of the surface
/// is found at each. Drops those that have more support than the one that wins by what the edges show, `compare`,
/// against all before it. Only candidates with nothing against them on their own take part.
[[nodiscard]] std::vector<Candidate> without_beaten_at_edges(std::vector<Candidate> candidates,
                                                             const model::PreparedModel& model,
                                                             const VerifyOptions& options, const Comparison& compare);

/// Decides from refined candidates: accepted, ambiguous or rejected, with the reason and the numbers. Rivals in the
/// same place are told apart by `compare`, if it is there, else by their support alone. Rivals elsewhere make the pose
/// ambiguous, unless it is to be `one_of_several`: then whether they are placements of their own is for the caller.
[[nodiscard]] Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model,
                               const VerifyOptions& options, const Comparison& compare = {},
                               bool one_of_several = false);

}  // namespace asbuilt::verify
