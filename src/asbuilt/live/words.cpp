// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "asbuilt/core/matrix_factors.h"

namespace asbuilt::live {
namespace {

std::string axis_in_words(const Eigen::Vector3d& direction) {
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  Eigen::Index axis = 0;
  if (direction.cwiseAbs().maxCoeff(&axis) > 0.95) return kAxes[static_cast<std::size_t>(axis)];
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x(), direction.y(), direction.z());
}

std::string percent(double share) {
  const double value = 100.0 * share;
  return value < 9.95 ? fmt::format("{:.1f} %", value) : fmt::format("{:.0f} %", value);
}

const LinkState* best_link(const LiveState& state, int scan) {
  const LinkState* best = nullptr;
  for (const LinkState& link : state.links) {
    if ((link.a == scan || link.b == scan) && link.used && (best == nullptr || link.overlap > best->overlap)) {
      best = &link;
    }
  }
  return best;
}

const std::string& name_of(const LiveState& state, int scan) {
  return state.scans[static_cast<std::size_t>(scan)].record.name;
}

struct Why {
  std::string what, detail;  // the detail may be empty
};

// What is known, without a guess at what is not.
Why why_not_used(const io::ScanRecord& record) {
  if (record.status == io::ScanStatus::failed) return {"could not be read", record.reason};
  if (record.status == io::ScanStatus::ambiguous) return {"the pose is ambiguous", record.reason};
  if (record.status == io::ScanStatus::dropped) return {"contradicts the other scans", record.reason};
  if (record.reason_code == "excluded") return {record.reason, {}};
  if (record.reason_code == "scan_too_small" || record.reason_code == "wrong_unit") return {record.reason, {}};
  if (record.candidates.empty()) return {"the part was not found in it", "nothing in it resembles the part"};
  return {"the part was not found in it", fmt::format("the best match was refused ({})", record.reason)};
}

}  // namespace

std::string side_in_words(const Eigen::Vector3d& outwards) {
  const Eigen::Vector3d d = outwards.normalized();
  const double elevation = std::asin(std::clamp(d.z(), -1.0, 1.0)) * 180.0 / std::numbers::pi;
  if (elevation > 75.0) return "above (+z)";
  if (elevation < -75.0) return "below (-z)";
  const double azimuth = std::atan2(d.y(), d.x()) * 180.0 / std::numbers::pi;
  constexpr std::array<const char*, 8> kSides{"+x", "between +x and +y", "+y", "between +y and -x",
                                              "-x", "between -x and -y", "-y", "between -y and +x"};
  const int sector = (static_cast<int>(std::lround(azimuth / 45.0)) + 8) % 8;
  const std::string side = kSides[static_cast<std::size_t>(sector)];
  if (std::abs(elevation) < 3.0) return side;
  return fmt::format("{}, {:.0f}° {}", side, std::abs(elevation), elevation > 0 ? "above" : "below");
}

std::string hole_in_words(const Hole& hole, const io::CadFaceNames& names) {
  const double cm2 = hole.area_mm2 / 100.0;
  std::string text = cm2 < 9.95 ? fmt::format("{:.1f} cm²", cm2) : fmt::format("{:.0f} cm²", cm2);
  text += fmt::format(" near ({:.0f}, {:.0f}, {:.0f})", hole.centre.x(), hole.centre.y(), hole.centre.z());
  if (!hole.normal.isZero()) text += ", facing " + side_in_words(hole.normal);
  if (hole.face >= 0) text += ", CAD " + io::face_label(hole.face, names);
  return text;
}

std::string view_in_words(const ViewProposal& proposal) {
  const Eigen::Vector3d away = proposal.view.position - proposal.view.target;
  std::string text = fmt::format("from {}, {:.0f} mm away", side_in_words(away), away.norm());
  if (proposal.purpose == Purpose::join) text += ", where both pieces are in view";
  return text + fmt::format(": about {} new surface", percent(proposal.gain_share));
}

std::string firmness(double overlap, double linked_from) {
  if (overlap >= 2.5 * linked_from) return "firm";
  return overlap >= linked_from ? "fair" : "weak";
}

std::string sentence_for(const LiveState& state, std::size_t scan) {
  const ScanState& entry = state.scans[scan];
  const auto index = static_cast<int>(scan);
  const std::string& name = entry.record.name;
  const std::string early = entry.provisional ? " (first look, being confirmed)" : "";
  if (!entry.in_use()) {
    const auto [what, detail] = why_not_used(entry.record);
    return fmt::format("{}: not used, {}{}{}{}.", name, what, detail.empty() ? "" : ": ", detail, early);
  }
  const std::string brought = fmt::format("{} of the surface, {} of it new to the session",
                                          percent(entry.covered_share), percent(entry.new_share));
  std::string text = fmt::format("{}: accepted{}, {}", name, early, brought);
  const bool alone = std::ranges::count_if(state.scans, &ScanState::in_use) == 1;
  if (alone) return text + ".";
  if (const LinkState* link = best_link(state, index)) {
    const auto links = std::ranges::count_if(
        state.links, [&](const LinkState& l) { return l.used && (l.a == index || l.b == index); });
    text += fmt::format("; linked to {} scan{}, best to {} ({}, {} overlap)", links, links == 1 ? "" : "s",
                        name_of(state, link->a == index ? link->b : link->a), link->firmness, percent(link->overlap));
  } else {
    text += "; overlap too small: it hangs loose from all others";
  }
  if (!entry.weak_directions.empty()) text += "; " + entry.weak_directions.front().text;
  return text + ".";
}

void set_now(LiveState& state) {
  const auto say = [&](const char* level, std::string headline, const std::string& more = {}) {
    state.now_level = level;
    state.now_text = more.empty() ? headline : headline + " " + more;
    state.now_headline = std::move(headline);
  };
  const std::string next = state.views.empty() ? std::string() : "Next: " + state.views.front().text + ".";
  if (!state.troubles.empty()) {
    const Trouble& worst = state.troubles.begin()->second;
    return say("bad", worst.headline, worst.detail);
  }
  if (state.newest >= 0 && !state.scans[static_cast<std::size_t>(state.newest)].in_use()) {
    const io::ScanRecord& record = state.scans[static_cast<std::size_t>(state.newest)].record;
    const auto [what, detail] = why_not_used(record);
    return say("bad", fmt::format("{} is not used: {}.", record.name, what),
               (detail.empty() ? "" : fmt::format("Why: {}. ", detail)) + next);
  }
  if (state.pieces.empty()) {
    return say("act",
               state.views.empty() ? "Take the first scan." : "Take the first scan: " + state.views.front().text + ".");
  }
  if (state.pieces.size() > 1) {
    const PieceState& loose = state.pieces[1];
    const std::string headline = fmt::format(
        "In pieces: {} hang{} loose.",
        loose.scans.size() == 1 ? name_of(state, loose.scans.front()) : fmt::format("{} scans", loose.scans.size()),
        loose.scans.size() == 1 ? "s" : "");
    if (loose.join && loose.join->view >= 0) {
      const ViewState& view = state.views[static_cast<std::size_t>(loose.join->view)];
      return say("warn", headline, "To join: " + view.text + ".");
    }
    return say("warn", headline,
               "No single view shows enough of both pieces; scan on from one piece towards the other. " + next);
  }
  if (state.views.empty()) {
    const std::string share = percent(state.covered_share);
    if (!state.coverable_share) return say("good", fmt::format("{} of the surface is scanned.", share));
    return say("good", fmt::format("Done: {} of the surface is scanned.", share),
               "No position would bring more than a trifle.");
  }
  say("act", next);
}

std::vector<WeakDirection> weak_directions(const Matrix6d& covariance, const Eigen::Vector3d& centre,
                                           double diameter_mm, double noise_sigma_mm) {
  if (!covariance.allFinite() || covariance.isZero(0.0)) return {};
  // Turns in mm at a quarter of the diameter from the centre, so that they compare with shifts.
  Matrix6d moved = Matrix6d::Identity();
  moved.topLeftCorner<3, 3>() *= 0.25 * diameter_mm;
  moved.bottomLeftCorner<3, 3>() = -cross_matrix(centre);
  const SymmetricEigen<6> solver(moved * covariance * moved.transpose());
  const Vector6d sigma = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const double usual = std::max(sigma[2], 1e-9);
  std::vector<WeakDirection> weak;
  for (Eigen::Index i = 5; i >= 4; --i) {
    if (sigma[i] < 4.0 * usual || sigma[i] < std::max(noise_sigma_mm, 1e-3)) continue;
    const Vector6d twist = solver.eigenvectors().col(i);
    WeakDirection direction;
    direction.is_rotation = twist.head<3>().norm() > twist.tail<3>().norm();
    direction.direction = (direction.is_rotation ? twist.head<3>() : twist.tail<3>()).normalized();
    direction.sigma_mm = sigma[i];
    direction.unheld = sigma[i] > 0.1 * diameter_mm;
    direction.text = fmt::format("held weakly: may {} {} by {}", direction.is_rotation ? "turn about" : "slide along",
                                 axis_in_words(direction.direction),
                                 direction.unheld ? std::string("any amount") : fmt::format("{:.2g} mm", sigma[i]));
    weak.push_back(std::move(direction));
  }
  return weak;
}

}  // namespace asbuilt::live
