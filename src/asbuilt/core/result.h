// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace asbuilt {

/// What kind of thing went wrong. The command line maps each to an exit code (docs/cli.md).
enum class ErrorCode {
  invalid_argument,   ///< an option or a call makes no sense
  unreadable_input,   ///< a file is missing, damaged, empty or of an unknown kind
  unwritable_output,  ///< an output could not be written
  not_possible,       ///< valid input, but the task has no answer for it
  cancelled,          ///< the caller asked to stop
};

/// One sentence naming the thing, the place, what was found and what was expected.
struct Error {
  ErrorCode code = ErrorCode::invalid_argument;
  std::string message;
};

/// A value or the reason why there is none. Becomes std::expected one day.
template <class T>
using Result = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected(Error{code, std::move(message)});
}

}  // namespace asbuilt

/// Declares `name` from a Result expression, or returns its error from the enclosing function.
#define ASBUILT_TRY(name, ...)                                         \
  auto name##_or_error = (__VA_ARGS__);                                \
  if (!name##_or_error) return tl::unexpected(name##_or_error.error()); \
  auto& name = *name##_or_error

/// For Result<void>: returns the error, if there is one.
#define ASBUILT_CHECK(...)                                                  \
  do {                                                                      \
    if (auto checked = (__VA_ARGS__); !checked) return tl::unexpected(checked.error()); \
  } while (false)

/// A precondition of the caller's; throws std::logic_error when broken.
#define ASBUILT_EXPECT(condition, what)                                              \
  do {                                                                               \
    if (!(condition)) throw std::logic_error(std::string("asbuilt: expected ") + (what)); \
  } while (false)
