// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"
#include "asbuilt/verify/segment.h"

namespace asbuilt::verify {

struct VerifyOptions {
  double score_distance_mm = 0.0;  ///< tau_theta of Eq. 11; 0: from noise and spacing (architecture.md)
  double deviation_ratio = 0.005;  ///< as-built deviation to be expected / diameter: added to score_distance
  double acceptance_score = 0.7;   ///< Xi over the should-be-visible samples that a detection needs
  double min_normal_agreement =
      0.65;                          ///< share of the points on the model whose normals must agree (paper: a majority)
  int min_explained_samples = 60;    ///< model samples that must be confirmed before anything is proved
  double min_margin = 0.03;          ///< support by which the best pose must beat any different one
  double min_contrast = 12.0;        ///< measurements by which it must lead where the two predict different things
  double min_contrast_share = 0.75;  ///< of these measurements, that must speak for it
  double max_free_space_share = 0.08;     ///< of should-be-visible samples seen through
  double max_residual_ratio = 0.35;       ///< RMS of the points on the model / score distance (0.58: evenly strewn)
  double max_contradiction_share = 0.03;  ///< of should-be-visible samples that the scan denies
  double min_proof = 0.34;                ///< score * normal agreement * (1 - residual ratio / 0.58)
  double hidden_surcharge =
      0.15;  ///< added to min_proof per share of the part that other things hide: what hides can lie
  double missing_surcharge = 0.3;         ///< likewise per share that should be visible and returned nothing
  double edges_surcharge = 0.12;          ///< likewise where only edges hold the pose
  double no_rays_surcharge = 0.26;        ///< likewise where the viewpoint is unknown: no ray can refute a lie
  double min_weakest_direction = 0.0035;  ///< see PoseEvidence::weakest_direction; not needed where the edges hold it
  double missing_hold_surcharge =
      3.0;  ///< times as much more of it is asked for per share that returned nothing; of edges twice that
  double near_equal_ratio = 0.01;   ///< surfaces of two poses this close / diameter, everywhere, need not be told apart
  double max_overrun_share = 0.12;  ///< of the edges past which the scan's surface may go on
  double max_joint_denial =
      1.0;  ///< contradictions and overrun, each as a share of its limit, together: right poses hardly exceed 0.8
  double max_pierced_share = 0.1;      ///< of the part, that may reach through a flat surface not its own
  double max_lost_end_share = 0.03;    ///< of what was looked at, at an end of unknown place, where nothing came back
  double max_normal_angle_deg = 30.0;  ///< normals closer than this agree
  bool is_one_of_many = false;         ///< set by a patient look: of so many poses that are tried, more is asked
  bool paper_mode = false;

  [[nodiscard]] Result<void> validate() const;

  /// The published judge: Xi of Eq. 11 over all model samples, within 1.5 mm unless stated, a threshold, and a majority
  /// of the normals. The paper names no threshold; ours lies below what its most hidden scans show.
  [[nodiscard]] VerifyOptions as_published() const {
    VerifyOptions published = *this;
    published.paper_mode = true;
    if (published.score_distance_mm == 0.0) published.score_distance_mm = 1.5;
    published.acceptance_score = 0.12;
    published.min_normal_agreement = 0.5;
    published.min_explained_samples = 0;
    return published;
  }
};

template <class Visitor>
void for_each_field(VerifyOptions& options, Visitor&& field) {
  field("score_distance", options.score_distance_mm,
        "distance that counts as on the model, mm (0: from noise and spacing)");
  field("deviation_ratio", options.deviation_ratio, "as-built deviation to be expected / diameter");
  field("acceptance_score", options.acceptance_score, "score that a detection needs");
  field("min_normal_agreement", options.min_normal_agreement, "share of the normals that must agree");
  field("min_explained_samples", options.min_explained_samples, "model samples that must be confirmed");
  field("min_margin", options.min_margin, "support by which the best pose must beat any different one");
  field("min_contrast", options.min_contrast, "measurements that must tell the best pose from a similar one");
  field("min_contrast_share", options.min_contrast_share, "share of these measurements that must speak for it");
  field("max_free_space_share", options.max_free_space_share,
        "share of the claimed surface the sensor may see through");
  field("max_residual_ratio", options.max_residual_ratio, "RMS of the points on the model / score distance");
  field("max_contradiction_share", options.max_contradiction_share,
        "share of the claimed surface that the scan may deny");
  field("min_proof", options.min_proof, "score * normal agreement * fit that a detection needs");
  field("hidden_surcharge", options.hidden_surcharge, "added to min_proof per share of the part that is hidden");
  field("edges_surcharge", options.edges_surcharge, "likewise where only edges hold the pose");
  field("missing_surcharge", options.missing_surcharge, "likewise per share that returned nothing");
  field("no_rays_surcharge", options.no_rays_surcharge, "likewise where the viewpoint is unknown");
  field("min_weakest_direction", options.min_weakest_direction, "how firmly the found surface must hold the pose");
  field("missing_hold_surcharge", options.missing_hold_surcharge,
        "how many times more hold is asked for per share that returned nothing; twice that of edges");
  field("near_equal_ratio", options.near_equal_ratio,
        "distance / diameter within which the surfaces of two poses need not be told apart");
  field("max_overrun_share", options.max_overrun_share, "share of the edges past which the surface may go on");
  field("max_joint_denial", options.max_joint_denial,
        "sum of contradictions and overrun, each as a share of its limit");
  field("max_lost_end_share", options.max_lost_end_share,
        "share of the claimed surface that may lie at an end of unknown place and have returned nothing");
  field("max_pierced_share", options.max_pierced_share,
        "share of the part that may reach through a flat surface not its own where edges hold its pose or size");
  field("max_normal_angle_deg", options.max_normal_angle_deg, "normals closer than this agree");
}

/// How many candidates go through the pyramid: a quick look carries at most half as many as a thorough one, a patient
/// look four times as many at first and twice as many in the end. Of the many hypotheses that it is for, one may pass
/// by chance, so it allows only half the overrun, and half the contradictions of a pose that is not proved far beyond
/// what is asked for.
enum class Look { quick, thorough, patient };

/// Judges hypotheses about one scan: coarse-to-fine LM-ICP, score, competition, normals (Sec. 3.1), and cuts the part
/// out. What the scan is asked by (trees, depth image, planes) is made once, for any number of questions.
class Judge {
 public:
  /// With `taken` (one byte a point of the scan) the best of several placements is sought: points marked in it belong
  /// to those known already, they confirm nothing, but are cut out with the rest; and rivals elsewhere are left to the
  /// caller. `sampled`, if it is at hand, is the scan as detection looked at it. Scan, model, options (valid ones) and
  /// context have to outlive the judge.
  Judge(const scan::Scan& scan, const model::PreparedModel& model, const VerifyOptions& options, const Context& context,
        std::span<const std::uint8_t> taken = {}, const detect::SampledScan* sampled = nullptr);
  ~Judge();
  Judge(Judge&&) noexcept;
  Judge& operator=(Judge&&) noexcept;

  /// A pose that the user vouches for (`--accept`, `--poses`) enters as a hypothesis; `accept_anyway` skips the verdict
  /// for the best of them and says so in the explanation. Errors: cancelled.
  [[nodiscard]] Result<Detection> verdict_on(std::span<const detect::Hypothesis> hypotheses, Look look = Look::thorough,
                                             bool accept_anyway = false) const;

 private:
  struct Material;
  class Verification;
  std::unique_ptr<const Material> material_;
};

/// The part's points at a pose that is known, and those around them: what a judge cuts out at the pose that it accepts.
/// `sampled` is the scan, or a thinned copy of it, as detection looked at it; what lies on its large planes is not the
/// part's.
[[nodiscard]] Segment part_at(const Pose& model_from_scan, const scan::Scan& scan, const model::PreparedModel& model,
                              const VerifyOptions& options, const detect::SampledScan& sampled, const Context& context);

/// One question to a judge of its own.
[[nodiscard]] Result<Detection> verify(const scan::Scan& scan, const model::PreparedModel& model,
                                       std::span<const detect::Hypothesis> hypotheses, const VerifyOptions& options,
                                       const Context& context, bool accept_anyway = false,
                                       std::span<const std::uint8_t> taken = {},
                                       const detect::SampledScan* sampled = nullptr);

}  // namespace asbuilt::verify
