// SPDX-License-Identifier: Apache-2.0
// Raw bytes to the live server over a socket, as anybody on the machine can send them; after a first byte that says to
// which of two servers: 't' to one that asks for a token, anything else to one that does not. Each must answer with a
// status line or none, let nobody in who did not name this machine or has no token, write nothing but files with the
// names of scans into the watched folder and nothing outside of it, and go on.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <string_view>

#include "asbuilt/live/folder_watch.h"
#include "server.h"

namespace {

namespace fs = std::filesystem;
namespace viewer = asbuilt::viewer;

constexpr std::uintmax_t kLargestUpload = 2048;

[[noreturn]] void complain(std::string_view what) {
  std::cerr << what << '\n';
  std::abort();
}

template <class Call>
ssize_t uninterrupted(const Call& call) {
  ssize_t result = 0;
  do {
    result = call();
  } while (result < 0 && errno == EINTR);
  return result;
}

/// A server with a state that never changes, over a folder of its own: BASE/watched.
class Target {
 public:
  explicit Target(const std::string& token)
      : base_(fs::temp_directory_path() /
              fmt::format("asbuilt-fuzz-http-{}{}", ::getpid(), token.empty() ? "" : "-guarded")) {
    fs::create_directories(watched());
    std::ofstream(base_ / "beside.ply") << "beside";
    const auto constant = [](const char* text) { return [text] { return std::string(text); }; };
    viewer::Content content{[] { return std::uint64_t{1}; },
                            [] { return std::pair(std::uint64_t{1}, std::string(R"({"schema":1,"revision":1})")); },
                            constant(R"({"schema":1})"), R"({"schema":1})"};
    viewer::ServerOptions options;
    options.port = 0;
    options.largest_upload = kLargestUpload;
    options.token = token;
    const auto known = [](const std::string& file) { return file == "known.ply"; };
    auto server = viewer::Server::start(std::move(content), watched(), options, {known, known, [] {}});
    if (!server) complain(server.error().message);
    server_ = std::move(*server);
  }
  ~Target() {
    server_.reset();
    fs::remove_all(base_);
  }

  /// Sends the bytes and gives back what comes until the server closes, or enough of it.
  [[nodiscard]] std::string answer_to(std::string_view bytes) const {
    const int connection = connected();
    while (!bytes.empty()) {
      const ssize_t sent = uninterrupted([&] { return ::send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL); });
      if (sent <= 0) break;  // it has answered and closed
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    ::shutdown(connection, SHUT_WR);
    std::string answer;
    std::array<char, 4096> block;
    // Events come for ever: the present state is enough.
    while (answer.find("\nevent: state\n") == std::string::npos) {
      const ssize_t got = uninterrupted([&] { return ::recv(connection, block.data(), block.size(), 0); });
      if (got < 0 && errno == EAGAIN) complain("the server does not answer");
      if (got <= 0) break;
      answer.append(block.data(), static_cast<std::size_t>(got));
    }
    ::close(connection);
    server_->state_changed();  // those that listened notice that nobody is there
    return answer;
  }

  /// Nothing but whole scans may lie there; clears the folder.
  void check_folder() const {
    std::size_t outside = 0;
    for (const auto& entry : fs::directory_iterator(base_)) {
      ++outside;
      if (entry.path() != watched() && entry.path() != base_ / "beside.ply") complain("a file was written outside");
    }
    if (outside != 2) complain("a file outside is gone");
    for (const auto& entry : fs::directory_iterator(watched())) {
      const std::string file = entry.path().filename().string();
      if (!entry.is_regular_file() || !asbuilt::live::is_scan_name(file)) complain("left behind: " + file);
      if (entry.file_size() == 0 || entry.file_size() > kLargestUpload)
        complain("an upload of another size than allowed");
      fs::remove(entry.path());
    }
  }

 private:
  [[nodiscard]] int connected() const {
    // A closed connection keeps its pair of ports for a minute: there are enough addresses, not enough ports.
    static std::uint32_t connections = 0;
    const sockaddr_in own = on_loopback(INADDR_LOOPBACK + ++connections % 4096, 0);
    const sockaddr_in address = on_loopback(INADDR_LOOPBACK, static_cast<std::uint16_t>(server_->port()));
    const timeval patience{4, 0};
    const int yes = 1;
    for (;;) {
      const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (connection < 0) complain("no socket");
      ::setsockopt(connection, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &yes, sizeof(yes));
      ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
      if (::bind(connection, reinterpret_cast<const sockaddr*>(&own), sizeof(own)) != 0) complain("no address");
      if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return connection;
      if (errno != EINTR) {  // the fuzzer's own clock
        complain(fmt::format("the server takes no connection any more: {}", std::strerror(errno)));
      }
      ::close(connection);
    }
  }

  static sockaddr_in on_loopback(std::uint32_t address, std::uint16_t port) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(address);
    place.sin_port = htons(port);
    return place;
  }

  [[nodiscard]] fs::path watched() const { return base_ / "watched"; }

  fs::path base_;
  std::unique_ptr<viewer::Server> server_;
};

constexpr std::string_view kVersion = "HTTP/1.1 ";
constexpr std::size_t kStatusAt = kVersion.size();

bool is_status_line(std::string_view answer) {
  if (!answer.starts_with(kVersion) || answer.size() < kVersion.size() + 4) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::isdigit(static_cast<unsigned char>(answer[kVersion.size() + i])) == 0) return false;
  }
  return answer[kVersion.size()] >= '1' && answer[kVersion.size()] <= '5';
}

/// Whether a request says anywhere that it is for this machine: what lets it pass must at least be in it.
bool names_this_machine(std::string_view request) {
  std::string lower(request);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto has = [&](std::string_view word) { return lower.find(word) != std::string::npos; };
  return has("host") && (has("localhost") || has("127.0.0.1") || has("::1"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Target open{""}, guarded{"0f5a71c3e9d24b8861b7"};
  if (size == 0) return 0;
  const bool is_guarded = data[0] == 't';
  const std::string_view request(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Target& target = is_guarded ? guarded : open;
  const std::string answer = target.answer_to(request);
  if (!answer.empty() && !is_status_line(answer)) complain("no HTTP: " + answer.substr(0, 100));
  const bool let_in = answer.size() > kStatusAt && answer[kStatusAt] == '2';
  if (let_in && is_guarded) complain("let in without the token");
  if (let_in && !names_this_machine(request)) complain("let in from elsewhere");
  target.check_folder();
  return 0;
}
