// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

#include "asbuilt/core/pose.h"
#include "asbuilt/live/state.h"

/// What an operator reads.
namespace asbuilt::live {

/// "+x, 20° above", "-y, 5° below", "above": whence one looks, in the model frame with z up.
[[nodiscard]] std::string side_in_words(const Eigen::Vector3d& outwards);

/// "120 cm² near (12, -80, 30), facing -y, CAD face 12".
[[nodiscard]] std::string hole_in_words(const Hole& hole, const io::CadFaceNames& names);

/// "from +x, 20° above, 640 mm away: about 14 % new surface".
[[nodiscard]] std::string view_in_words(const ViewProposal& proposal);

/// One sentence on what became of a scan; its links are looked up in the state.
[[nodiscard]] std::string sentence_for(const LiveState& state, std::size_t scan);

/// Level, headline and text of the one big line: a trouble first, then what became of the newest scan, then what to do.
/// The text begins with the headline, which is short enough to be read from where the scanner stands.
void set_now(LiveState& state);

/// The directions in which a pose is held much worse than in the others, about `centre`, at most two.
[[nodiscard]] std::vector<WeakDirection> weak_directions(const Matrix6d& covariance, const Eigen::Vector3d& centre,
                                                         double diameter_mm, double noise_sigma_mm);

/// "firm", "fair", "weak": by overlap, against the one from which scans are linked.
[[nodiscard]] std::string firmness(double overlap, double linked_from);

}  // namespace asbuilt::live
