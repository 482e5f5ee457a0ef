// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "asbuilt/core/result.h"

namespace asbuilt::viewer {

struct ServerOptions {
  std::string host = "127.0.0.1";
  int port = 8600;    ///< 0: any that is free
  std::string token;  ///< empty: none on loopback, a random one elsewhere
  std::uint64_t largest_upload = 4ULL << 30U;
};

/// What is served, as JSON of docs/live-protocol.md. Asked by threads of the server.
struct Content {
  std::function<std::uint64_t()> revision;                       ///< of the present state
  std::function<std::pair<std::uint64_t, std::string>()> state;  ///< with its revision
  std::function<std::string()> values;
  std::string surface;  ///< constant
};

/// What a request asks of the session; called by threads of the server, must return at once.
struct Requests {
  std::function<bool(const std::string& file)> take_out;  ///< false: no such file
  std::function<bool(const std::string& file)> restore;
  std::function<void()> write_result;
};

/// The protocol of docs/live-protocol.md. Writes uploads into the watched folder (whole or not at all), and hands
/// everything else on.
class Server {
 public:
  /// Errors: unwritable_output (the port is taken, or no such address), with nothing left running.
  [[nodiscard]] static Result<std::unique_ptr<Server>> start(Content content, const std::filesystem::path& watched,
                                                             const ServerOptions& options, Requests requests);
  ~Server();

  [[nodiscard]] int port() const;
  [[nodiscard]] std::string token() const;
  [[nodiscard]] std::string address() const;  ///< "http://localhost:8600/", with the token if there is one

  /// Wakes those that listen to events.
  void state_changed();

 private:
  struct Implementation;
  explicit Server(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt::viewer
