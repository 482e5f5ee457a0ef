// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/unit.h"
#include "asbuilt/model/prepared_file.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/pipeline/options.h"

namespace asbuilt::pipeline {

/// The CAD prior and what the record says of it.
struct LoadedModel {
  model::PreparedModel prepared;
  io::Unit unit = io::Unit::stated;  ///< in which the file was taken to be; `stated` for a prepared model
  io::ModelRecord record;
};

/// Reads MODEL: a mesh or CAD surfaces, which are prepared, or a prepared model as `asbuilt prepare` writes it (then
/// `options.model` and the unit were decided when it was written, and `use` says what of it is needed). Errors:
/// unreadable_input, not_possible, cancelled.
[[nodiscard]] Result<LoadedModel> load_model(const std::string& path, const Options& options, const Context& context,
                                             model::PreparedFor use = model::PreparedFor::everything);

}  // namespace asbuilt::pipeline
