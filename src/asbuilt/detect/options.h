// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/result.h"

namespace asbuilt::detect {

struct DetectOptions {
  double search_spacing_ratio = 0.08;  ///< the part is sought in points about this share of the sampling distance apart
                                       ///< where a scan has far more, and cut out of all; 0: always sought in all
  int angle_bins = 15;                 ///< bins over [0, pi] for each of the three angles of Eq. 6
  double distance_bin_ratio = 1.0;     ///< width of a distance bin / sampling distance d
  int neighbour_bins = 4;              ///< K of Eq. 8, at most 16 (a feature has 2^4 border neighbours); > 1
  double border_reach = 0.35;  ///< a neighbouring bin counts only for values this close to it, in bins (0.5: always)
  double bucket_weight_exponent = 0.3;   ///< e of a vote's weight N_b^-e; paper: 1, which lets rare features rule
  double bucket_cap = 4.0;               ///< buckets with more than this many entries per model sample do not vote
  int alpha_bins = 30;                   ///< bins over (-pi, pi] for the rotation about the normal
  int first_reference_points = 400;      ///< scene reference points of a first look; 0: none is taken
  int first_hypotheses = 60;             ///< clusters of the first look that are verified
  int reference_points = 1000;           ///< scene reference points; paper: 400-1000
  int max_hypotheses = 200;              ///< clusters handed to verification; paper: some 50
  int last_reference_points = 5000;      ///< scene reference points of a last look; 0: none is taken
  double most_million_votes = 1500.0;    ///< the last look ends when so many have been cast
  int last_hypotheses = 1500;            ///< clusters of the last look that are verified
  double cluster_angle_deg = 15.0;       ///< poses closer than this in rotation ...
  double cluster_distance_ratio = 0.06;  ///< ... and than this share of the diameter at the model's centre are one
  int peaks_per_reference = 3;           ///< maxima of one voting space that are kept, if close to the best
  double peak_ratio = 0.85;              ///< "close": share of the best maximum's votes
  int last_peaks_per_reference = 20;     ///< the same in the last look, where what agrees from many reference points
  double last_peak_ratio = 0.3;          ///< need be among the best of none
  bool joint_visibility = true;          ///< pairs that no single viewpoint sees have no place in the codebook
  bool single_votes = true;              ///< a pair votes once for a model sample and sector of alpha
  bool leave_out_planes = true;          ///< flat pieces too large for the part take no part
  bool smooth_maxima = true;             ///< votes are smoothed over the angle, maxima interpolated
  bool visible_maxima = true;            ///< a maximum counts if its model sample can be seen at that pose
  bool paper_mode = false;               ///< exactly the published method

  [[nodiscard]] Result<void> validate() const;

  /// The published method: K bins always, every bucket votes, one maximum per reference point, 50 clusters.
  [[nodiscard]] DetectOptions as_published() const {
    DetectOptions published = *this;
    published.paper_mode = true;
    published.bucket_weight_exponent = 1.0;
    published.search_spacing_ratio = 0.0;
    published.border_reach = 0.5;
    published.peaks_per_reference = 1;
    published.first_reference_points = 0;
    published.last_reference_points = 0;
    published.last_peaks_per_reference = 1;
    published.max_hypotheses = 50;
    published.joint_visibility = false;
    published.single_votes = false;
    published.leave_out_planes = false;
    published.smooth_maxima = false;
    published.visible_maxima = false;
    return published;
  }
};

template <class Visitor>
void for_each_field(DetectOptions& options, Visitor&& field) {
  field("search_spacing_ratio", options.search_spacing_ratio,
        "spacing / sampling distance to which denser scans are thinned to find the part (0: never)");
  field("angle_bins", options.angle_bins, "bins over [0, 180] degrees for each angle of a point pair feature");
  field("distance_bin_ratio", options.distance_bin_ratio, "width of a distance bin / sampling distance");
  field("neighbour_bins", options.neighbour_bins, "K, bins that a scene feature activates (Eq. 8)");
  field("border_reach", options.border_reach, "how close to a border a value must lie for the bin beyond to count");
  field("bucket_weight_exponent", options.bucket_weight_exponent, "e of a vote's weight N_b^-e (paper: 1)");
  field("bucket_cap", options.bucket_cap, "buckets with more entries per model sample do not vote");
  field("alpha_bins", options.alpha_bins, "bins for the rotation about the reference normal");
  field("first_reference_points", options.first_reference_points,
        "scene reference points of a first look, which is enough where the part is beyond doubt (0: none)");
  field("first_hypotheses", options.first_hypotheses, "pose clusters of the first look that are verified");
  field("reference_points", options.reference_points, "scene reference points");
  field("max_hypotheses", options.max_hypotheses, "pose clusters handed to verification");
  field("last_reference_points", options.last_reference_points,
        "scene reference points of a last look, taken where the part was not found (0: none)");
  field("most_million_votes", options.most_million_votes,
        "millions of votes of one scan after which the last look lets no more points vote");
  field("last_hypotheses", options.last_hypotheses, "pose clusters of the last look that are verified");
  field("cluster_angle_deg", options.cluster_angle_deg, "rotation within which hypotheses are one pose");
  field("cluster_distance_ratio", options.cluster_distance_ratio, "distance / diameter within which they are");
  field("peaks_per_reference", options.peaks_per_reference, "maxima kept per reference point");
  field("peak_ratio", options.peak_ratio, "votes of a further maximum / votes of the best");
  field("last_peaks_per_reference", options.last_peaks_per_reference, "maxima kept per reference point in a last look");
  field("last_peak_ratio", options.last_peak_ratio, "votes of a further maximum / votes of the best in a last look");
  field("joint_visibility", options.joint_visibility, "pairs that no single viewpoint sees do not vote");
  field("single_votes", options.single_votes, "a pair votes once for a model sample and sector of angle");
  field("leave_out_planes", options.leave_out_planes, "flat pieces too large for the part do not vote");
  field("smooth_maxima", options.smooth_maxima, "votes are smoothed over the angle, maxima interpolated");
  field("visible_maxima", options.visible_maxima, "a maximum counts if its model sample can be seen at that pose");
}

}  // namespace asbuilt::detect
