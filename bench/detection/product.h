// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/pipeline/options.h"
#include "cases.h"
#include "record.h"

namespace asbuilt::bench {

/// A part as the product prepares it, once for all its scans.
struct PreparedPart {
  model::PreparedModel model;
  std::shared_ptr<const detect::Codebook> codebook;
};
[[nodiscard]] Result<PreparedPart> prepared(const SuitePart& part, const pipeline::Options& options,
                                            const Context& context);

/// Takes the scan the way the pipeline takes it (scan preparation, size check, detection, verification) and notes what
/// came of it and how long each step took. An error of a stage is a status, "failed".
/// `options` have paper mode applied.
[[nodiscard]] Result<void> judge(CaseRecord& record, const CaseScan& scan, const SuitePart& part,
                                 const PreparedPart& prepared, const pipeline::Options& options,
                                 const Context& context);

}  // namespace asbuilt::bench
