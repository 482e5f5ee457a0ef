// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/scan_relations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>

#include "asbuilt/refine/model_turn.h"
#include "asbuilt/refine/symmetry_choice.h"
#include "asbuilt/refine/view_difference.h"
#include "asbuilt/verify/near_poses.h"

namespace asbuilt::pipeline {
namespace {

PosedScan& scan_of(int view, const RefinedComponent& component, std::vector<PosedScan>& scans) {
  return scans[static_cast<std::size_t>(component.members[static_cast<std::size_t>(view)])];
}

std::vector<Pose> refined_poses(const RefinedComponent& component, const std::vector<PosedScan>& scans) {
  std::vector<Pose> poses;
  for (const int member : component.members) poses.push_back(scans[static_cast<std::size_t>(member)].model_from_local);
  return poses;
}

std::string names_of(const std::vector<int>& views, const RefinedComponent& component,
                     const std::vector<PosedScan>& scans, const io::RunRecord& record) {
  std::string names;
  for (const int view : views) {
    const auto member = static_cast<std::size_t>(component.members[static_cast<std::size_t>(view)]);
    names += (names.empty() ? "" : ", ") + record.scans[static_cast<std::size_t>(scans[member].index)].name;
  }
  return names;
}

// Where scans may slide along one another by as much as a dent is deep, dents that are the same lie in different
// places, and nothing can be read from what differs.
bool are_held(const RefinedComponent& component, double diameter_mm) {
  constexpr double kMostSlide = 0.003;  // of the diameter, 1 sigma
  return std::ranges::none_of(component.refinement.view_holds, [&](const refine::ViewHold& hold) {
    return std::ranges::any_of(hold.loose, [&](const refine::LooseMotion& loose) {
      return loose.unheld || loose.sigma_mm > kMostSlide * diameter_mm;
    });
  });
}

void leave_out(const PosedScan& scan, std::string reason, io::RunRecord& record, const Context& context) {
  io::ScanRecord& entry = record.scans[static_cast<std::size_t>(scan.index)];
  entry.status = io::ScanStatus::ambiguous;
  entry.reason_code = "symmetry";
  entry.reason = std::move(reason);
  context.warn(fmt::format("{}: ambiguous: {}", entry.path, entry.reason));
}

// The axis of near-symmetry that most of the surface goes round, with the smallest turn of the part's own group about
// it.
refine::TurnAxis turn_axis(const model::SymmetryGroup& symmetry) {
  constexpr double kSameAxis = 0.999;
  const model::NearAxis& near = symmetry.near_axes.front();
  const bool has_turns = symmetry.kind == model::SymmetryGroup::Kind::discrete && symmetry.order > 1 &&
                         std::abs(near.axis.dot(symmetry.axis)) > kSameAxis;
  return {near.axis, near.point, 2.0 * std::numbers::pi / (has_turns ? symmetry.order : 1)};
}

// `looks` says to what turns the part is blind.
void say_that_turns_are_unknown(std::string_view looks, const std::vector<PosedScan>& scans, io::RunRecord& record,
                                const Context& context) {
  for (const PosedScan& scan : scans) {
    io::ScanRecord& entry = record.scans[static_cast<std::size_t>(scan.index)];
    if (!entry.reason_code.empty()) continue;
    entry.reason_code = "symmetry";
    entry.reason = fmt::format("{}: how it is turned against the other scans is not known", looks);
  }
  context.warn(fmt::format("{}: how the scans are turned against one another is not known", looks));
}

// `why` ends the sentence that no scan tells the placements apart.
void say_that_nothing_tells(const RefinedComponent& component, std::size_t placements, std::string_view why,
                            std::vector<PosedScan>& scans, io::RunRecord& record, const Context& context) {
  for (std::size_t v = 0; v < component.members.size(); ++v) {
    const PosedScan& scan = scan_of(static_cast<int>(v), component, scans);
    io::ScanRecord& entry = record.scans[static_cast<std::size_t>(scan.index)];
    if (!entry.reason_code.empty()) continue;
    entry.reason_code = "symmetry";
    entry.reason = fmt::format("the part has {} placements that its CAD does not tell apart, and {}", placements, why);
  }
  context.warn(fmt::format(
      "the part has {} placements that its CAD does not tell apart, and {}: which way round each scan belongs "
      "is not known",
      placements, why));
}

}  // namespace

Result<void> choose_turns(std::vector<PosedScan>& scans, const LoadedModel& model, double near_equal_ratio,
                          io::RunRecord& record, const Context& context) {
  const model::SymmetryGroup& symmetry = model.prepared.symmetry;
  using Kind = model::SymmetryGroup::Kind;
  if (scans.size() < 2) return {};
  if (symmetry.kind == Kind::revolution || symmetry.kind == Kind::sphere) {
    // A dent may show in two scans, but not from where: turned at random they do not see it in the same place.
    const std::string_view about = symmetry.kind == Kind::sphere ? "its centre" : "its axis";
    say_that_turns_are_unknown(fmt::format("the part looks the same at any turn about {}", about), scans, record,
                               context);
    return {};
  }
  if (!verify::turns_are_nearly_equal(model.prepared, near_equal_ratio)) return {};
  const refine::TurnAxis axis = turn_axis(symmetry);
  std::vector<std::size_t> untold;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    PosedScan& scan = scans[s];
    if (record.scans[static_cast<std::size_t>(scan.index)].reason_code == "accepted_by_user") continue;
    const refine::View view{scan.part, scan.model_from_local_detected, scan.noise_sigma_mm, scan.viewpoint};
    ASBUILT_TRY(turn, refine::turn_on_model(view, *model.prepared.surface, model.prepared.diameter, axis, context));
    if (!turn.is_told) {
      untold.push_back(s);
    } else if (turn.angle_rad != 0.0) {
      scan.model_from_local_detected = orthonormalised(
          model::rotation_about(axis.direction, axis.point, turn.angle_rad) * scan.model_from_local_detected);
    }
  }
  if (untold.empty()) return {};
  if (untold.size() + 2 > scans.size()) {
    say_that_turns_are_unknown(
        "the part looks nearly the same at any turn about its axis, and the scans do not show theirs", scans, record,
        context);
    return {};
  }
  for (auto s = untold.rbegin(); s != untold.rend(); ++s) {
    leave_out(scans[*s],
              "the part looks nearly the same at any turn about its axis; other scans show theirs, this one does not",
              record, context);
    scans.erase(scans.begin() + static_cast<std::ptrdiff_t>(*s));
  }
  return {};
}

Result<bool> choose_placements(const RefinedComponent& component, std::vector<PosedScan>& scans,
                               const LoadedModel& model, io::RunRecord& record, const Context& context) {
  const model::SymmetryGroup& symmetry = model.prepared.symmetry;
  if (symmetry.kind != model::SymmetryGroup::Kind::discrete || component.members.size() < 2) return false;
  if (!are_held(component, model.prepared.diameter)) {
    say_that_nothing_tells(component, symmetry.elements.size(),
                           "the scans hold one another too loosely to tell what was built differently", scans, record,
                           context);
    return false;
  }
  const refine::ComparedViews views(views_of(component.members, scans), model.prepared.diameter, context);
  ASBUILT_TRY(choice, refine::choose_elements(views, refined_poses(component, scans), component.links,
                                              symmetry.elements, context));
  if (std::ranges::count(choice.decided, 1) == 1) {
    say_that_nothing_tells(component, symmetry.elements.size(),
                           "to within the noise the scans are alike in all of them", scans, record, context);
    return false;
  }
  bool changed = false;
  std::vector<int> undecided;
  for (std::size_t v = 0; v < component.members.size(); ++v) {
    PosedScan& scan = scan_of(static_cast<int>(v), component, scans);
    const bool vouched_for = record.scans[static_cast<std::size_t>(scan.index)].reason_code == "accepted_by_user";
    if (choice.decided[v] == 0) {
      if (!vouched_for) undecided.push_back(component.members[v]);
      continue;
    }
    if (choice.element[v] == 0 || vouched_for) continue;
    const Pose& element = symmetry.elements[static_cast<std::size_t>(choice.element[v])];
    scan.model_from_local_detected = orthonormalised(element * scan.model_from_local_detected);
    changed = true;
  }
  std::ranges::sort(undecided, std::ranges::greater{});
  for (const int member : undecided) {
    leave_out(
        scans[static_cast<std::size_t>(member)],
        fmt::format("the part has {} placements that its CAD does not tell apart; other scans show what was built "
                    "differently, this one does not show where it belongs",
                    symmetry.elements.size()),
        record, context);
    scans.erase(scans.begin() + member);
  }
  return changed || !undecided.empty();
}

Result<bool> separate_individuals(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                  const LoadedModel& model, const io::RunRecord& record, const Context& context) {
  if (component.members.size() < 4 || !are_held(component, model.prepared.diameter)) return false;
  // Of a symmetric part whose placements nobody knows, one face may be held against another.
  const bool is_placed = std::ranges::none_of(component.members, [&](int member) {
    const PosedScan& scan = scans[static_cast<std::size_t>(member)];
    return record.scans[static_cast<std::size_t>(scan.index)].reason_code == "symmetry";
  });
  if (!is_placed) return false;
  const refine::ComparedViews views(views_of(component.members, scans), model.prepared.diameter, context);
  ASBUILT_TRY(found, refine::two_individuals(views, refined_poses(component, scans), component.links, context));
  if (!found) return false;
  int next = 1 + std::ranges::max_element(scans, {}, &PosedScan::individual)->individual;
  for (const std::vector<int>& group : {found->first, found->second}) {
    const std::string reason = fmt::format(
        "of another individual: where both were measured, its surface lies elsewhere in {:.0f} % of the places, "
        "usually by {:.3g} mm (among scans of one individual in {:.1f} %); these belong together: {}",
        100.0 * found->share_between, found->height_mm, 100.0 * found->share_within,
        names_of(group, component, scans, record));
    for (const int view : group) {
      PosedScan& scan = scan_of(view, component, scans);
      scan.individual_reason = reason;
      if (group == found->second) scan.individual = next;
    }
  }
  for (const int view : found->undecided) {
    PosedScan& scan = scan_of(view, component, scans);
    scan.individual = ++next;
    scan.individual_reason = fmt::format(
        "of one of two individuals, and it does not show of which: it meets the others only where both are alike; "
        "these belong together: {}; and these: {}",
        names_of(found->first, component, scans, record), names_of(found->second, component, scans, record));
  }
  return true;
}

}  // namespace asbuilt::pipeline
