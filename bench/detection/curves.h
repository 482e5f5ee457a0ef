// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "record.h"

namespace asbuilt::bench {

/// A line of a diagram.
struct Series {
  std::string name;
  std::vector<double> x, y;
  std::vector<double> low, high;  ///< Wilson 95 % about y; empty or as long as y
  std::size_t colour = 0;
  bool dashed = false;
};

struct Diagram {
  std::string file;  ///< name without extension
  std::string title, x_label, y_label;
  std::vector<Series> series;
};

/// Precision over recall while a threshold falls: of all poses that are trusted at least so much, how many are right,
/// and how many of the scans with the part they find. Points with equal trust enter together.
[[nodiscard]] Series precision_recall(std::string name, std::span<const CaseRecord> records, Judged CaseRecord::*judged,
                                      const std::function<double(const CaseRecord&)>& trust);

/// How much the judge trusts the best candidate: accepted before ambiguous before rejected, each by score.
[[nodiscard]] double verified_trust(const CaseRecord& record);

/// Recall of the accepted poses over a figure of the scans, in `bins` of about as many scans each.
[[nodiscard]] Series recall_over(std::string name, std::span<const CaseRecord> records, double CaseRecord::*figure,
                                 std::size_t bins);

/// All diagrams of a suite: precision and recall with and without verification; recall over hidden share, occlusion and
/// clutter; a line for each mode.
[[nodiscard]] std::vector<Diagram> diagrams_of(std::span<const CaseRecord> records);

/// A diagram of shares, both axes from 0 to 1, as an SVG file.
[[nodiscard]] std::string to_svg(const Diagram& diagram);

}  // namespace asbuilt::bench
