// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/as_detected.h"

namespace asbuilt::pipeline {

io::ScanRecord as_detected(io::ScanRecord scan) {
  using enum io::ScanStatus;
  scan.covariance.reset();
  scan.component.reset();
  scan.hold_sigma.clear();
  scan.loose_motions.clear();
  scan.model_from_scan.reset();
  if (scan.status == dropped || scan.status == disconnected || scan.reason_code == "symmetry") {
    scan.status = accepted;
    scan.reason_code.clear();
    scan.reason.clear();
  }
  if (scan.status == accepted || scan.status == ambiguous) scan.model_from_scan = scan.model_from_scan_detected;
  return scan;
}

}  // namespace asbuilt::pipeline
