// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>

#include "asbuilt/io/unit.h"
#include "asbuilt/pipeline/options.h"
#include "shell.h"

namespace asbuilt::cli {

/// --threads --memory --quiet --json --config, and --force where there is an output.
void add_common_options(CLI::App& command, Shell& shell, bool has_output = true);

/// Options between the stages and of the stages, as far as they belong to these halves of the method.
void add_pipeline_options(CLI::App& command, pipeline::Options& options, std::initializer_list<pipeline::Half> halves);

/// An option for a unit of length by its name.
void add_unit_option(CLI::App& command, const std::string& name, io::Unit& unit, const std::string& help);

/// --tolerance, --alignment, --align-on, --reference, --views, --colour-steps.
void add_inspection_options(CLI::App& command, pipeline::Options& options);

/// "--angle-bins" for the field `angle_bins`.
[[nodiscard]] std::string flag_of(const std::string& field);

/// One option per field of a stage's options, for use with for_each_field.
template <class Value>
void add_field(CLI::App& command, const std::string& name, Value& value, const std::string& help,
               const std::string& group) {
  if constexpr (std::is_same_v<Value, bool>) {
    const std::string off = "!--no-" + flag_of(name).substr(2);
    command.add_flag(flag_of(name) + "," + off, value, help)->group(group)->default_str(value ? "true" : "false");
  } else {
    command.add_option(flag_of(name), value, help)->group(group)->capture_default_str();
  }
}

}  // namespace asbuilt::cli
