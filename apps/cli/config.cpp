// SPDX-License-Identifier: Apache-2.0
#include "config.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>

#include "asbuilt/io/file.h"
#include "options.h"

namespace asbuilt::cli {
namespace {

constexpr std::string_view kFlag = "--config";

std::optional<std::string> config_file(const std::vector<std::string>& arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == kFlag && i + 1 < arguments.size()) return arguments[i + 1];
    if (arguments[i].starts_with("--config=")) return arguments[i].substr(kFlag.size() + 1);
  }
  return std::nullopt;
}

const CLI::App* command_named(const CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

bool is_typed(const std::string& flag, const std::vector<std::string>& arguments) {
  return std::ranges::any_of(
      arguments, [&](const std::string& argument) { return argument == flag || argument.starts_with(flag + "="); });
}

/// The arguments that one line of the file stands for.
std::vector<std::string> arguments_of(const std::string& flag, const CLI::ConfigItem& item) {
  std::vector<std::string> arguments;
  for (const std::string& input : item.inputs) arguments.push_back(fmt::format("{}={}", flag, input));
  return arguments;
}

Result<std::vector<CLI::ConfigItem>> read_items(const std::string& path) {
  ASBUILT_TRY(content, io::read_file(path));
  try {
    std::istringstream stream(content);
    return CLI::ConfigTOML().from_config(stream);
  } catch (const CLI::Error& error) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: {}; expected TOML, NAME = VALUE", path, error.what()));
  }
}

}  // namespace

Result<std::vector<std::string>> with_config(const CLI::App& app, std::vector<std::string> arguments) {
  const auto path = config_file(arguments);
  const auto verb = std::ranges::find_if(
      arguments, [&](const std::string& argument) { return command_named(app, argument) != nullptr; });
  if (!path || verb == arguments.end()) return arguments;
  const CLI::App* command = command_named(app, *verb);
  ASBUILT_TRY(items, read_items(*path));

  std::vector<std::string> from_file;
  for (const CLI::ConfigItem& item : items) {
    const bool is_marker = item.name == "++" || item.name == "--";  // CLI11's own, around sections
    const bool is_for_verb = item.parents.empty() || item.parents == std::vector<std::string>{*verb};
    if (is_marker || !is_for_verb) continue;
    const std::string flag = flag_of(item.name);
    if (command->get_option_no_throw(flag) == nullptr) {
      return fail(ErrorCode::invalid_argument, fmt::format("{}: asbuilt {} has no option '{}'; asbuilt {} --help lists "
                                                           "them",
                                                           *path, *verb, item.name, *verb));
    }
    if (flag == kFlag || is_typed(flag, arguments)) continue;
    const auto more = arguments_of(flag, item);
    from_file.insert(from_file.end(), more.begin(), more.end());
  }
  arguments.insert(verb + 1, from_file.begin(), from_file.end());
  return arguments;
}

}  // namespace asbuilt::cli
