// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::model {

/// Writes a prepared model (docs/model-file.md), whole or not at all; the same model gives the same bytes.
/// Search structures are not stored. Errors: unwritable_output.
[[nodiscard]] Result<void> save_prepared(const std::filesystem::path& path, const PreparedModel& model);

/// What a prepared model is read for.
enum class PreparedFor : std::uint8_t {
  everything,
  inspection,  ///< distances to the surface alone: `field` and `rays` stay null
};

/// Reads a prepared model and rebuilds its search structures, which for everything takes about as long as half a
/// prepare().
/// Errors: unreadable_input for a file that is missing, of another kind, newer than this version, cut short or damaged.
[[nodiscard]] Result<PreparedModel> load_prepared(const std::filesystem::path& path, const Context& context = Context(),
                                                  PreparedFor use = PreparedFor::everything);

/// Whether a file begins like a prepared model; says nothing about the rest of it.
[[nodiscard]] bool is_prepared_file(const std::filesystem::path& path);

}  // namespace asbuilt::model
