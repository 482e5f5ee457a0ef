// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <vector>

#include "support/matchers.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

const model::PreparedModel& coarse_block() {
  static const model::PreparedModel model = test::prepared(test::stepped_block(), 0.05);
  return model;
}

// One that nothing stands against.
Candidate flawless(const Eigen::Vector3d& where = {0, 0, 600}) {
  Candidate c;
  c.model_from_scan = test::pose_at(where).inverse();
  c.score = 0.95;
  c.visible_share = 0.4;
  c.normal_agreement = 0.95;
  c.residual_ratio = 0.15;
  c.rms_mm = 0.1;
  c.support = 0.4;
  c.weakest_direction = 0.05;
  c.size_hold = 0.05;
  c.explained_samples = 500;
  return c;
}

struct Flaw {
  Reason reason;
  std::function<void(Candidate&)> spoil;
};

TEST(Verdict, AcceptsACandidateThatNothingStandsAgainst) {
  const Detection detection = decide({flawless()}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::accepted);
  EXPECT_EQ(detection.reason, Reason::none);
  EXPECT_FALSE(detection.explanation.empty());
}

TEST(Verdict, GivesEachReasonToTheCandidateThatDeservesIt) {
  const std::vector<Flaw> flaws{
      {Reason::too_few_points, [](Candidate& c) { c.explained_samples = 5; }},
      {Reason::low_score, [](Candidate& c) { c.score = 0.3; }},
      {Reason::free_space_violated, [](Candidate& c) { c.free_space_violations = 0.3; }},
      {Reason::poor_fit, [](Candidate& c) { c.residual_ratio = 0.55; }},
      {Reason::contradicted, [](Candidate& c) { c.contradiction_share = 0.3; }},
      {Reason::under_constrained, [](Candidate& c) { c.weakest_direction = 0.0; }},
      {Reason::under_constrained, [](Candidate& c) { c.lost_end_share = 0.2; }},
      {Reason::under_constrained, [](Candidate& c) { c.pierced_share = 0.2; }},
      {Reason::normals_disagree, [](Candidate& c) { c.normal_agreement = 0.4; }},
      {Reason::weak_evidence,  // 0.75 * 0.78 * (1 - 0.34 / 0.577) = 0.24
       [](Candidate& c) { c.score = 0.75, c.normal_agreement = 0.78, c.residual_ratio = 0.34; }}};
  for (const Flaw& flaw : flaws) {
    Candidate candidate = flawless();
    flaw.spoil(candidate);
    const Detection detection = decide({candidate}, coarse_block(), {});
    EXPECT_EQ(detection.status, Status::rejected) << code_of(flaw.reason);
    EXPECT_STREQ(code_of(detection.reason), code_of(flaw.reason));
    EXPECT_THAT(detection.explanation, testing::ContainsRegex("[0-9]")) << "no numbers in the sentence";
  }
}

TEST(Verdict, WithoutCandidatesIsNoHypothesis) {
  const Detection detection = decide({}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::rejected);
  EXPECT_EQ(detection.reason, Reason::no_hypothesis);
}

TEST(Verdict, AsksForMoreProofWhereMoreIsHidden) {
  Candidate candidate = flawless();
  candidate.score = 0.8, candidate.normal_agreement = 0.85, candidate.residual_ratio = 0.2;  // proves 0.44
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.hidden_share = 0.8;  // 0.34 + 0.15 * 0.8 = 0.46
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::weak_evidence);
}

TEST(Verdict, WhereOnlyTheEdgesHoldAPoseAsksForManyMeasurementsAndLittleContradiction) {
  Candidate candidate = flawless();
  candidate.weakest_direction = 0.0, candidate.explained_measurements = 4000.0;
  candidate.slip_lead = 20.0;  // 0.6 % of 4000 are 24
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::under_constrained);
  candidate.slip_lead = 28.0;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.contradiction_share = 0.025;  // allowed where the surface holds it
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::under_constrained);
}

// 20 of at least 10.8 * (1 + 6 * missing) measurements.
TEST(Verdict, WhereTheSurfaceFitsAPartOfAnotherSizeItsEdgesMustTell) {
  const auto reason_of = [](double size_hold, double size_lead, double missing_share) {
    Candidate candidate = flawless();
    candidate.size_hold = size_hold, candidate.size_lead = size_lead, candidate.missing_share = missing_share;
    return decide({candidate}, coarse_block(), {}).reason;
  };
  EXPECT_EQ(reason_of(0.004, 0.0, 0.0), Reason::none);
  EXPECT_EQ(reason_of(0.003, 0.0, 0.0), Reason::under_constrained);
  EXPECT_EQ(reason_of(0.0, 20.0, 0.1), Reason::none);
  EXPECT_EQ(reason_of(0.0, 20.0, 0.2), Reason::under_constrained);
}

// 0.004 of at least 0.0035 * (1 + 3 * missing); 25 of at least 10.8 * (1 + 6 * missing) measurements.
TEST(Verdict, AsksForMoreHoldWhereMoreReturnedNothing) {
  const auto reason_of = [](double weakest_direction, double slip_lead, double missing_share) {
    Candidate candidate = flawless();
    candidate.weakest_direction = weakest_direction, candidate.slip_lead = slip_lead;
    candidate.loose_directions = 1, candidate.missing_share = missing_share;
    return decide({candidate}, coarse_block(), {}).reason;
  };
  EXPECT_EQ(reason_of(0.004, 0.0, 0.03), Reason::none);
  EXPECT_EQ(reason_of(0.004, 0.0, 0.08), Reason::under_constrained);
  EXPECT_EQ(reason_of(0.0, 25.0, 0.2), Reason::none);
  EXPECT_EQ(reason_of(0.0, 25.0, 0.3), Reason::under_constrained);
}

TEST(Verdict, TheOutlineOfOneFaceProvesAPlateButNotABlock) {
  Candidate candidate = flawless();
  candidate.weakest_direction = 0.0, candidate.explained_measurements = 1000.0, candidate.slip_lead = 500.0;
  candidate.loose_directions = 3, candidate.facing_share = 0.45;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.facing_share = 0.25;
  const Detection detection = decide({candidate}, coarse_block(), {});
  EXPECT_EQ(detection.reason, Reason::under_constrained);
  EXPECT_THAT(detection.explanation, testing::HasSubstr("25 %"));
  candidate.loose_directions = 1;  // two faces along one edge
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, ALittleMoreSurfaceDecidesNothingAlongWhatOnlyEdgesHold) {
  Candidate best = flawless(), rival = flawless();
  rival.model_from_scan.translate(Eigen::Vector3d(0.2 * coarse_block().diameter, 0, 0));
  rival.support = 0.9 * best.support;
  const Comparison undecided = [](const Candidate&, const Candidate&) { return PoseContrast{3.0, 2.0}; };
  EXPECT_EQ(decide({best, rival}, coarse_block(), {}, undecided).status, Status::accepted);
  for (Candidate* candidate : {&best, &rival}) {
    candidate->weakest_direction = 0.0, candidate->explained_measurements = 1000.0, candidate->slip_lead = 500.0;
  }
  EXPECT_EQ(decide({best, rival}, coarse_block(), {}, undecided).reason, Reason::ambiguous_pose);
}

// Loose poses of one place, displaced along x by `offsets_mm`, each with a little less support than the one before it.
std::vector<Candidate> held_by_edges(const std::vector<double>& offsets_mm) {
  std::vector<Candidate> candidates;
  for (const double offset_mm : offsets_mm) {
    Candidate c = flawless({offset_mm, 0, 600});
    c.weakest_direction = 0.0, c.explained_measurements = 1000.0, c.slip_lead = 500.0;
    c.support -= 0.001 * static_cast<double>(candidates.size());
    candidates.push_back(c);
  }
  return candidates;
}

double offset_mm(const Candidate& c) { return c.model_from_scan.inverse().translation().x(); }

// Edges that speak by `rate` a millimetre for what is nearer to x = 0.
Comparison nearer_wins(double rate) {
  return [rate](const Candidate& a, const Candidate& b) {
    return PoseContrast{rate * std::abs(offset_mm(b)), rate * std::abs(offset_mm(a))};
  };
}

TEST(Verdict, OfLoosePosesThatCountAsOneTheEdgesChoose) {
  const double step = 0.005 * coarse_block().diameter;
  const std::vector<Candidate> candidates = held_by_edges({2.0 * step, 3.0 * step, 0.0, step});
  EXPECT_NEAR(offset_mm(decide(candidates, coarse_block(), {}).best), 2.0 * step, 1e-9);  // the best by support
  const auto kept = without_beaten_at_edges(candidates, coarse_block(), {}, nearer_wins(10.0 / step));
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_NEAR(offset_mm(kept.front()), 0.0, 1e-9);
  EXPECT_NEAR(offset_mm(decide(kept, coarse_block(), {}).best), 0.0, 1e-9);
}

TEST(Verdict, EdgesChooseOnlyAmongLoosePosesOfOnePlaceThatNothingSpeaksAgainst) {
  const double step = 0.005 * coarse_block().diameter;
  const auto left_of = [](const std::vector<Candidate>& candidates, double rate) {
    return without_beaten_at_edges(candidates, coarse_block(), {}, nearer_wins(rate)).size();
  };
  std::vector<Candidate> candidates = held_by_edges({2.0 * step, 0.0});
  EXPECT_EQ(left_of(candidates, 10.0 / step), 1U);
  EXPECT_EQ(left_of(candidates, 0.5 / step), 2U) << "two measurements may be chance";
  candidates = held_by_edges({40.0 * step, 0.0});
  EXPECT_EQ(left_of(candidates, 10.0 / step), 2U) << "not the same pose: rivals";
  candidates = held_by_edges({2.0 * step, 0.0});
  candidates[0].weakest_direction = 0.05;
  EXPECT_EQ(left_of(candidates, 10.0 / step), 2U) << "the surface holds the first";
  candidates = held_by_edges({2.0 * step, 0.0});
  candidates[1].score = 0.3;
  EXPECT_EQ(left_of(candidates, 10.0 / step), 2U) << "the second is refused on its own";
}

TEST(Verdict, ALeadInSupportDecidesNothingWhereTheScanShowsNoDifference) {
  const Candidate best = flawless();
  Candidate rival = flawless();
  rival.model_from_scan.translate(Eigen::Vector3d(0.2 * coarse_block().diameter, 0, 0));
  rival.support = 0.9 * best.support;
  const Comparison nothing = [](const Candidate&, const Candidate&) { return PoseContrast{0.0, 0.0}; };
  const Detection detection = decide({best, rival}, coarse_block(), {}, nothing);
  EXPECT_EQ(detection.reason, Reason::ambiguous_pose);
  EXPECT_THAT(detection.explanation, testing::HasSubstr("does not show what tells the pose"));
}

TEST(Verdict, WithoutRaysEdgesMustShowMoreBeforeTheyHoldAPose) {
  Candidate candidate = flawless();
  candidate.weakest_direction = 0.0, candidate.explained_measurements = 4000.0, candidate.slip_lead = 50.0;
  candidate.residual_ratio = 0.05;  // proves enough without rays
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.without_rays = true;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::under_constrained);
  candidate.slip_lead = 150.0;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, IsBeyondDoubtOnlyWhereEveryLimitIsClearedByFar) {
  const auto judged = [](const std::function<void(Candidate&)>& spoil) {
    Candidate candidate = flawless();
    spoil(candidate);
    return decide({candidate}, coarse_block(), {});
  };
  EXPECT_TRUE(is_beyond_doubt(judged([](Candidate&) {}), {}));
  const std::vector<std::function<void(Candidate&)>> flaws{
      [](Candidate& c) { c.contradiction_share = 0.02; }, [](Candidate& c) { c.overrun_share = 0.1; },
      [](Candidate& c) { c.weakest_direction = 0.004; }, [](Candidate& c) { c.size_hold = 0.0, c.size_lead = 20.0; },
      [](Candidate& c) { c.residual_ratio = 0.3, c.normal_agreement = 0.8; }};
  for (const auto& spoil : flaws) {
    const Detection detection = judged(spoil);
    EXPECT_EQ(detection.status, Status::accepted) << detection.explanation;
    EXPECT_FALSE(is_beyond_doubt(detection, {}));
  }
  EXPECT_FALSE(is_beyond_doubt(judged([](Candidate& c) { c.score = 0.3; }), {}));
}

TEST(Verdict, AsksForMoreProofWhereMoreReturnedNothing) {
  Candidate candidate = flawless();
  candidate.score = 0.75, candidate.normal_agreement = 0.9, candidate.residual_ratio = 0.2;  // proves 0.44
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.missing_share = 0.45;  // 0.34 + 0.3 * 0.45 = 0.475
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::weak_evidence);
}

TEST(Verdict, AsksForMoreProofWhereOnlyEdgesHoldThePose) {
  Candidate candidate = flawless();
  candidate.score = 0.8, candidate.normal_agreement = 0.8, candidate.residual_ratio = 0.2;  // proves 0.42
  candidate.explained_measurements = 1000.0, candidate.slip_lead = 500.0;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.weakest_direction = 0.0;  // 0.34 + 0.12 = 0.46
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::weak_evidence);
  candidate.residual_ratio = 0.1;  // proves 0.53
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, AsksForMoreProofWhereNoRayCanRefuteThePose) {
  Candidate candidate = flawless();
  candidate.score = 0.9, candidate.normal_agreement = 0.9, candidate.residual_ratio = 0.2;  // proves 0.53
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.without_rays = true;  // 0.34 + 0.26 = 0.6
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::weak_evidence);
  candidate.residual_ratio = 0.1;  // proves 0.67
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, ContradictionsAndOverrunMayNotBothBeNearTheirLimits) {
  Candidate candidate = flawless();
  candidate.contradiction_share = 0.028;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.overrun_share = 0.03;  // 0.93 and 0.25 of their limits
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::contradicted);
  candidate.contradiction_share = 0.0;
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, OfManyPosesOneThatIsNotProvedFarBeyondMayBeDeniedHalfAsMuch) {
  VerifyOptions of_many;
  of_many.is_one_of_many = true;
  Candidate proved = flawless();  // 0.95 * 0.95 * (1 - 0.15 / 0.577) = 0.67; 1.5 * 0.34 = 0.51 is far beyond
  proved.contradiction_share = 0.8 * of_many.max_contradiction_share;
  Candidate doubtful = proved;  // 0.8 * 0.75 * (1 - 0.15 / 0.577) = 0.44
  doubtful.score = 0.8, doubtful.normal_agreement = 0.75;
  EXPECT_EQ(decide({proved}, coarse_block(), of_many).status, Status::accepted);
  EXPECT_EQ(decide({doubtful}, coarse_block(), {}).status, Status::accepted);
  EXPECT_EQ(decide({doubtful}, coarse_block(), of_many).reason, Reason::contradicted);
  doubtful.contradiction_share *= 0.5;
  EXPECT_EQ(decide({doubtful}, coarse_block(), of_many).status, Status::accepted);
}

TEST(Verdict, EdgesThatTheSurfacePassesWeakenTheProof) {
  Candidate candidate = flawless();
  candidate.score = 0.72, candidate.normal_agreement = 0.8, candidate.residual_ratio = 0.2;  // proves 0.376
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).status, Status::accepted);
  candidate.overrun_share = 0.11;  // allowed by itself; 0.376 * 0.89 = 0.335
  EXPECT_EQ(decide({candidate}, coarse_block(), {}).reason, Reason::weak_evidence);
}

TEST(Verdict, IsNotShakenByARefutedPoseWithMoreSupport) {
  Candidate larger_thing = flawless({0, 0, 900}), part = flawless();
  larger_thing.support = 0.5, larger_thing.overrun_share = 0.6;
  const Detection detection = decide({larger_thing, part}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::accepted);
  EXPECT_EQ(detection.best.overrun_share, 0.0);
  EXPECT_EQ(decide({larger_thing}, coarse_block(), {}).reason, Reason::contradicted);
}

TEST(Verdict, OnASecondInstanceIsAmbiguous) {
  const Detection detection = decide({flawless(), flawless({300, 0, 600})}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::ambiguous);
  EXPECT_EQ(detection.reason, Reason::second_instance);
  EXPECT_EQ(detection.candidates.size(), 2U);
}

TEST(Verdict, BesideAPoseBeyondDoubtAFaceBetweenEdgesIsNoSecondInstance) {
  const auto status_beside = [](const Candidate& best, double missing_share, double support) {
    Candidate face = flawless({300, 0, 600});
    face.weakest_direction = 0.0, face.slip_lead = 60.0, face.loose_directions = 2;
    face.missing_share = missing_share, face.support = support;
    return decide({best, face}, coarse_block(), {});
  };
  for (const double support : {0.3, 0.5}) {
    const Detection detection = status_beside(flawless(), 0.3, support);
    EXPECT_EQ(detection.status, Status::accepted) << detection.explanation;
    EXPECT_GT(detection.best.weakest_direction, 0.0);
  }
  EXPECT_EQ(status_beside(flawless(), 0.0, 0.3).reason, Reason::second_instance) << "edges hold it beyond doubt";
  Candidate doubtful = flawless();
  doubtful.contradiction_share = 0.02;
  EXPECT_EQ(status_beside(doubtful, 0.3, 0.3).reason, Reason::second_instance);
}

TEST(Verdict, KnowsASecondPlacementFromClutterAndFromAnotherPoseInThePlace) {
  const Candidate best = flawless();
  EXPECT_TRUE(is_second_instance(best, flawless({300, 0, 600}), coarse_block(), {}));
  EXPECT_FALSE(is_second_instance(best, flawless({5, 0, 600}), coarse_block(), {})) << "in the same place";
  Candidate rejected = flawless({300, 0, 600});
  rejected.score = 0.5;
  EXPECT_FALSE(is_second_instance(best, rejected, coarse_block(), {}));
  Candidate small = flawless({300, 0, 600});
  small.support = 0.2 * best.support;
  EXPECT_FALSE(is_second_instance(best, small, coarse_block(), {})) << "explains too little beside the best";
}

TEST(Verdict, TellsOfEveryCandidateWhatStandsAgainstIt) {
  Candidate loser = flawless({300, 0, 600});
  loser.support = 0.1, loser.score = 0.3;
  const Detection detection = decide({flawless(), loser}, coarse_block(), {});
  ASSERT_EQ(detection.candidates.size(), 2U);
  EXPECT_EQ(detection.candidates[0].objection, Reason::none);
  EXPECT_EQ(detection.candidates[1].objection, Reason::low_score);
}

TEST(Verdict, OnTwoPosesInOnePlaceIsAmbiguousIfTheyAreAboutEquallySupported) {
  Candidate turned = flawless();
  const Eigen::Translation3d centre(Eigen::Vector3d(bounding_box(coarse_block().skin).center()));
  turned.model_from_scan = centre * Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()) * centre.inverse() *
                           turned.model_from_scan;
  turned.support = 0.399;
  const Detection detection = decide({flawless(), turned}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::ambiguous);
  EXPECT_EQ(detection.reason, Reason::ambiguous_pose);
  turned.support = 0.3;
  EXPECT_EQ(decide({flawless(), turned}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, IsNotShakenByARivalThatWouldBeRejected) {
  Candidate rival = flawless({300, 0, 600});
  rival.free_space_violations = 0.5;
  EXPECT_EQ(decide({flawless(), rival}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, CountsNearlyEqualPosesAsOne) {
  Candidate again = flawless({0.5, 0, 600});
  again.support = 0.39, again.votes = 100.0;
  const Detection detection = decide({again, flawless()}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::accepted);
  EXPECT_EQ(detection.candidates.size(), 1U);
  EXPECT_EQ(detection.best.support, 0.4) << "the best, in whatever order they come";
  EXPECT_EQ(detection.best.votes, 100.0) << "the votes of all of them are for this pose";
  EXPECT_EQ(detection.margin, 0.4);
}

const model::PreparedModel& square() {
  static const model::PreparedModel model = test::prepared(test::notched_plate(12.0), 0.05);
  return model;
}

// About the z axis through the middle of the model.
Candidate turned(const Candidate& candidate, double angle, const model::PreparedModel& model) {
  Candidate other = candidate;
  other.model_from_scan =
      model::rotation_about(Eigen::Vector3d::UnitZ(), model.box.center(), angle) * candidate.model_from_scan;
  return other;
}

TEST(Verdict, TakesPosesThatTheSymmetryMakesOneForOne) {
  Candidate other = turned(flawless(), std::numbers::pi / 2, square());
  other.support = 0.399;
  const Detection detection = decide({flawless(), other}, square(), {});
  EXPECT_EQ(detection.status, Status::accepted) << detection.explanation;
  EXPECT_EQ(detection.candidates.size(), 1U);
  EXPECT_THAT(detection.explanation, testing::HasSubstr("4-fold"));
  EXPECT_LT(displacement_modulo_mm(flawless().model_from_scan, other.model_from_scan, square()), 0.5);
  EXPECT_GT(displacement_mm(flawless().model_from_scan, other.model_from_scan, square()), 90.0);
  EXPECT_EQ(decide({flawless(), turned(other, 0.4, square())}, square(), {}).reason, Reason::ambiguous_pose);
}

TEST(Verdict, BetweenRivalsGoesByWhereTheyDiffer) {
  const Candidate first = flawless();
  Candidate second = turned(first, std::numbers::pi, coarse_block());
  second.support = 0.399;
  PoseContrast seen;
  const Comparison compare = [&](const Candidate& a, const Candidate&) {
    const bool in_order = a.support == first.support;
    return in_order ? seen : PoseContrast{seen.for_second, seen.for_first};
  };
  seen = {60.0, 2.0};
  Detection detection = decide({first, second}, coarse_block(), {}, compare);
  EXPECT_EQ(detection.status, Status::accepted) << detection.explanation;
  EXPECT_EQ(detection.best.support, first.support);
  seen = {2.0, 60.0};
  detection = decide({first, second}, coarse_block(), {}, compare);
  EXPECT_EQ(detection.status, Status::accepted) << detection.explanation;
  EXPECT_EQ(detection.best.support, second.support) << "won where it counts, against a small lead in support";
  seen = {30.0, 25.0};
  detection = decide({first, second}, coarse_block(), {}, compare);
  EXPECT_EQ(detection.reason, Reason::ambiguous_pose);
  seen = {3.0, 0.0};
  detection = decide({first, second}, coarse_block(), {}, compare);
  EXPECT_EQ(detection.reason, Reason::ambiguous_pose);
  EXPECT_THAT(detection.explanation, testing::HasSubstr("does not show"));
}

TEST(Verdict, IsAmbiguousWhereOnlyTheTurnAboutANearAxisIsLoose) {
  Candidate loose = flawless();
  loose.weakest_direction = 0.0;
  EXPECT_EQ(decide({loose}, coarse_block(), {}).reason, Reason::under_constrained);
  loose.weakest_but_near = 0.05;
  const Detection detection = decide({loose}, coarse_block(), {});
  EXPECT_EQ(detection.status, Status::ambiguous);
  EXPECT_EQ(detection.reason, Reason::ambiguous_pose);
  loose.weakest_direction = 0.003;  // of 500 samples, 1.5 hold the turn
  EXPECT_EQ(decide({loose}, coarse_block(), {}).status, Status::accepted);
}

TEST(Verdict, InPaperModeKnowsNoSymmetry) {
  VerifyOptions options;
  options.paper_mode = true;
  EXPECT_EQ(
      decide({flawless(), turned(flawless(), std::numbers::pi / 2, square())}, square(), options).candidates.size(),
      2U);
}

TEST(Verdict, InPaperModeLooksAtScoreAndNormalsAlone) {
  VerifyOptions options;
  options.paper_mode = true;
  Candidate candidate = flawless();
  candidate.free_space_violations = 0.5, candidate.contradiction_share = 0.5, candidate.weakest_direction = 0.0;
  EXPECT_EQ(decide({candidate}, coarse_block(), options).status, Status::accepted);
  candidate.normal_agreement = 0.3;
  EXPECT_EQ(decide({candidate}, coarse_block(), options).reason, Reason::normals_disagree);
}

TEST(Reasons, HaveCodesThatAreAllDifferent) {
  std::set<std::string> codes;
  for (int reason = 0; reason <= static_cast<int>(Reason::wrong_unit); ++reason) {
    codes.insert(code_of(static_cast<Reason>(reason)));
  }
  EXPECT_EQ(codes.size(), static_cast<std::size_t>(Reason::wrong_unit) + 1U);
}

TEST(Displacement, BoundsThatOfEveryVertex) {
  const Pose a = test::pose_at({1, 2, 3}), b = test::pose_at({2, 2, 3}, {2.2, 0.6, 0.4});
  const Pose b_from_a = b * a.inverse();
  double largest = 0.0;
  for (const Eigen::Vector3d& vertex : coarse_block().skin.vertices) {
    largest = std::max(largest, (b_from_a * vertex - vertex).norm());
  }
  EXPECT_GE(displacement_mm(a, b, coarse_block()), largest - 1e-9);
  EXPECT_LT(displacement_mm(a, a, coarse_block()), 1e-9);
}

}  // namespace
}  // namespace asbuilt::verify
