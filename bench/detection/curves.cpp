// SPDX-License-Identifier: Apache-2.0
#include "curves.h"

#include <algorithm>
#include <set>

#include "statistics.h"

namespace asbuilt::bench {
namespace {

std::vector<CaseRecord> of_mode(std::span<const CaseRecord> records, const std::string& mode) {
  std::vector<CaseRecord> some;
  std::ranges::copy_if(records, std::back_inserter(some), [&](const CaseRecord& r) { return r.mode == mode; });
  return some;
}

void add_share(Series& series, double x, std::size_t hits, std::size_t trials) {
  const Interval interval = wilson_interval(hits, trials);
  series.x.push_back(x);
  series.y.push_back(static_cast<double>(hits) / static_cast<double>(trials));
  series.low.push_back(interval.low);
  series.high.push_back(interval.high);
}

}  // namespace

Series precision_recall(std::string name, std::span<const CaseRecord> records, Judged CaseRecord::*judged,
                        const std::function<double(const CaseRecord&)>& trust) {
  struct Ranked {
    double trust;
    bool right;
  };
  const auto present = static_cast<double>(std::ranges::count_if(records, &CaseRecord::present));
  std::vector<Ranked> poses;
  for (const CaseRecord& record : records) {
    if ((record.*judged).has_pose) poses.push_back({trust(record), (record.*judged).right});
  }
  std::ranges::stable_sort(poses, std::ranges::greater(), &Ranked::trust);
  Series series;
  series.name = std::move(name);
  std::size_t right = 0;
  for (std::size_t i = 0; i < poses.size() && present > 0.0; ++i) {
    right += poses[i].right ? 1 : 0;
    if (i + 1 < poses.size() && poses[i + 1].trust == poses[i].trust) continue;
    series.x.push_back(static_cast<double>(right) / present);
    series.y.push_back(static_cast<double>(right) / static_cast<double>(i + 1));
  }
  return series;
}

double verified_trust(const CaseRecord& record) {
  const double step = record.accepted() ? 2.0 : record.status == "ambiguous" ? 1.0 : 0.0;
  return 2.0 * step + record.best.score;  // a score is at most 1
}

Series recall_over(std::string name, std::span<const CaseRecord> records, double CaseRecord::*figure,
                   std::size_t bins) {
  std::vector<CaseRecord> present;
  std::ranges::copy_if(records, std::back_inserter(present), &CaseRecord::present);
  std::ranges::stable_sort(present, {}, figure);
  Series series;
  series.name = std::move(name);
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * present.size() / bins, end = (bin + 1) * present.size() / bins;
    if (begin == end) continue;
    const std::span<const CaseRecord> own(present.data() + begin, end - begin);
    double sum = 0.0;
    for (const CaseRecord& record : own) sum += record.*figure;
    const auto found = static_cast<std::size_t>(std::ranges::count_if(own, &CaseRecord::found));
    add_share(series, sum / static_cast<double>(own.size()), found, own.size());
  }
  return series;
}

std::vector<Diagram> diagrams_of(std::span<const CaseRecord> records) {
  std::set<std::string> modes;
  for (const CaseRecord& record : records) modes.insert(record.mode);
  Diagram curve{"precision_recall", "Precision over recall", "recall", "precision", {}};
  std::vector<Diagram> over{{"recall_hidden", "Recall over the hidden share", "hidden share", "recall", {}},
                            {"recall_occlusion", "Recall over occlusion", "occlusion", "recall", {}},
                            {"recall_clutter", "Recall over clutter", "clutter", "recall", {}}};
  constexpr double CaseRecord::*kFigures[] = {&CaseRecord::hidden, &CaseRecord::occlusion, &CaseRecord::clutter};
  constexpr std::size_t kScansABin = 20, kMostBins = 10;
  std::size_t colour = 0;
  for (const std::string& mode : modes) {
    const std::vector<CaseRecord> own = of_mode(records, mode);
    const bool verified = !mode.starts_with("opencv");
    if (verified) {
      curve.series.push_back(precision_recall(mode, own, &CaseRecord::best, verified_trust));
      curve.series.back().colour = colour;
    }
    curve.series.push_back(precision_recall(mode + ", unverified, by votes", own, &CaseRecord::unverified,
                                            [](const CaseRecord& r) { return r.unverified.score; }));
    curve.series.back().colour = colour;
    curve.series.back().dashed = true;
    const auto present = static_cast<std::size_t>(std::ranges::count_if(own, &CaseRecord::present));
    const std::size_t bins = std::clamp<std::size_t>(present / kScansABin, 1, kMostBins);
    for (std::size_t i = 0; i < over.size(); ++i) {
      over[i].series.push_back(recall_over(mode, own, kFigures[i], bins));
      over[i].series.back().colour = colour;
    }
    ++colour;
  }
  over.insert(over.begin(), std::move(curve));
  return over;
}

}  // namespace asbuilt::bench
