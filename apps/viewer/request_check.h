// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

/// What the live server decides about a request before anything is done. Free of sockets, for tests and fuzzing.
namespace asbuilt::viewer {

/// Who may ask (docs/live-protocol.md).
struct AccessRules {
  bool on_loopback = true;
  int port = 0;
  std::string token;  ///< empty: none is asked for
};

struct RequestHead {
  std::string host, origin, authorization, token;  ///< empty where absent; `token` from the query
};

struct Refusal {
  int status = 403;
  std::string reason;  ///< one sentence
};

/// Nothing if the request may pass.
[[nodiscard]] std::optional<Refusal> refusal_of(const RequestHead& head, const AccessRules& rules);

/// Compares in a time that does not depend on where they differ.
[[nodiscard]] bool same_secret(std::string_view a, std::string_view b);

/// Why a file may not have this name; nothing if it may.
[[nodiscard]] std::optional<std::string> objection_to_name(std::string_view file);

/// Whether an address is one that only this machine reaches.
[[nodiscard]] bool is_loopback(std::string_view host);

/// A token that nobody guesses: 128 random bits from the system, as hexadecimal digits.
[[nodiscard]] std::string random_token();

}  // namespace asbuilt::viewer
