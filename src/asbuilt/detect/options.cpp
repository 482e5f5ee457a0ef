// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/options.h"

#include "asbuilt/core/option_check.h"
#include "asbuilt/detect/point_pair.h"

namespace asbuilt::detect {

Result<void> DetectOptions::validate() const {
  ASBUILT_CHECK(expect_between("search_spacing_ratio", search_spacing_ratio, 0.0, 0.3));
  ASBUILT_CHECK(expect_between("angle_bins", angle_bins, 3, 90));
  ASBUILT_CHECK(expect_between("distance_bin_ratio", distance_bin_ratio, 0.1, 10.0));
  ASBUILT_CHECK(expect_between("neighbour_bins", neighbour_bins, 1, int{Quantisation::kMostNeighbours}));
  ASBUILT_CHECK(expect_between("bucket_weight_exponent", bucket_weight_exponent, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("border_reach", border_reach, 0.0, 0.5));
  ASBUILT_CHECK(expect_between("bucket_cap", bucket_cap, 0.01, 1e6));
  ASBUILT_CHECK(expect_between("cluster_angle_deg", cluster_angle_deg, 0.0, 180.0));
  ASBUILT_CHECK(expect_between("cluster_distance_ratio", cluster_distance_ratio, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("alpha_bins", alpha_bins, 6, 180));
  ASBUILT_CHECK(expect_between("first_reference_points", first_reference_points, 0, 1000000));
  ASBUILT_CHECK(expect_between("first_hypotheses", first_hypotheses, 1, 100000));
  ASBUILT_CHECK(expect_between("reference_points", reference_points, 1, 1000000));
  ASBUILT_CHECK(expect_between("max_hypotheses", max_hypotheses, 1, 100000));
  ASBUILT_CHECK(expect_between("last_reference_points", last_reference_points, 0, 1000000));
  ASBUILT_CHECK(expect_between("most_million_votes", most_million_votes, 0.0, 1e6));
  ASBUILT_CHECK(expect_between("last_hypotheses", last_hypotheses, 1, 100000));
  ASBUILT_CHECK(expect_between("peaks_per_reference", peaks_per_reference, 1, 100));
  ASBUILT_CHECK(expect_between("peak_ratio", peak_ratio, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("last_peaks_per_reference", last_peaks_per_reference, 1, 1000));
  ASBUILT_CHECK(expect_between("last_peak_ratio", last_peak_ratio, 0.0, 1.0));
  return {};
}

}  // namespace asbuilt::detect
