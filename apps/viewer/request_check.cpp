// SPDX-License-Identifier: Apache-2.0
#include "request_check.h"

#include <fmt/format.h>

#include <random>

#include "asbuilt/live/folder_watch.h"

namespace asbuilt::viewer {
namespace {

struct Authority {
  std::string_view host;
  std::string_view port;
};

// "localhost:8600", "127.0.0.1", "[::1]:8600".
Authority authority_of(std::string_view text) {
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return {};
    const std::string_view rest = text.substr(end + 1);
    if (!rest.empty() && !rest.starts_with(':')) return {};
    return {text.substr(1, end - 1), rest.empty() ? rest : rest.substr(1)};
  }
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return {text, {}};
  return {text.substr(0, colon), text.substr(colon + 1)};
}

bool is_local_name(std::string_view authority, int port) {
  const Authority asked = authority_of(authority);
  return is_loopback(asked.host) && (asked.port.empty() || asked.port == std::to_string(port));
}

std::string_view without_scheme(std::string_view origin) {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) ? origin.substr(kScheme.size()) : std::string_view();
}

}  // namespace

bool is_loopback(std::string_view host) {
  return host == "localhost" || host == "127.0.0.1" || host == "::1" || host == "[::1]";
}

bool same_secret(std::string_view a, std::string_view b) {
  unsigned different = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const char other = b.empty() ? '\0' : b[i % b.size()];
    different |= static_cast<unsigned>(static_cast<unsigned char>(a[i] ^ other));
  }
  return different == 0U;
}

std::optional<Refusal> refusal_of(const RequestHead& head, const AccessRules& rules) {
  // A page of another site may reach us by a name of its own that points here (DNS rebinding).
  if (rules.on_loopback && !is_local_name(head.host, rules.port)) {
    return Refusal{403, "this server answers to localhost only"};
  }
  // Browsers say where a request comes from; one of another site's page is refused whatever it knows.
  if (!head.origin.empty() && without_scheme(head.origin) != head.host) {
    return Refusal{403, "requests from pages of other sites are refused"};
  }
  if (rules.token.empty()) return std::nullopt;
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view given = head.authorization.starts_with(kBearer)
                                     ? std::string_view(head.authorization).substr(kBearer.size())
                                     : std::string_view(head.token);
  if (same_secret(given, rules.token)) return std::nullopt;
  return Refusal{
      401, given.empty() ? "a token is needed, as ?token=... or as Authorization: Bearer ..." : "the token is wrong"};
}

std::optional<std::string> objection_to_name(std::string_view file) {
  if (live::is_scan_name(file)) return std::nullopt;
  return "the name of a scan is a plain file name of at most 200 bytes, not hidden, with an extension that scans have";
}

std::string random_token() {
  std::random_device system;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(system()));
  return token;
}

}  // namespace asbuilt::viewer
