// SPDX-License-Identifier: Apache-2.0
// Raw bytes to the live server over a socket, as anybody on the machine can send them. The server must answer each with
// a status line or none, write nothing but files with the names of scans into the watched folder and nothing outside of
// it, and go on.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cstdint>
#include <cstdlib>
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

[[noreturn]] void complain(std::string_view what) {
  std::cerr << what << '\n';
  std::abort();
}

/// A server with a state that never changes, over a folder of its own: BASE/watched.
class Target {
 public:
  Target() {
    fs::create_directories(watched());
    std::ofstream(base_ / "beside.ply") << "beside";
    const auto constant = [](const char* text) { return [text] { return std::string(text); }; };
    viewer::Content content{[] { return std::uint64_t{1}; },
                            [] { return std::pair(std::uint64_t{1}, std::string(R"({"schema":1,"revision":1})")); },
                            constant(R"({"schema":1})"), R"({"schema":1})"};
    viewer::ServerOptions options;
    options.port = 0;
    options.largest_upload = 2048;
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
    const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (connection < 0) complain("no socket");
    const timeval patience{20, 0};
    ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(server_->port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      complain("the server takes no connection any more");
    }
    while (!bytes.empty()) {
      const ssize_t sent = ::send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) break;  // it has answered and closed
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    ::shutdown(connection, SHUT_WR);
    std::string answer;
    std::array<char, 4096> block;
    for (ssize_t got = 0; (got = ::recv(connection, block.data(), block.size(), 0)) > 0;) {
      answer.append(block.data(), static_cast<std::size_t>(got));
      // Events come for ever: the present state is enough.
      if (answer.find("\nevent: state\n") != std::string::npos) break;
    }
    if (errno == EAGAIN) complain("the server does not answer");
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
      if (entry.file_size() == 0 || entry.file_size() > 2048) complain("an upload of another size than allowed");
      fs::remove(entry.path());
    }
  }

 private:
  [[nodiscard]] fs::path watched() const { return base_ / "watched"; }

  fs::path base_ = fs::temp_directory_path() / ("asbuilt-fuzz-http-" + std::to_string(::getpid()));
  std::unique_ptr<viewer::Server> server_;
};

bool is_status_line(std::string_view answer) {
  constexpr std::string_view kVersion = "HTTP/1.1 ";
  if (!answer.starts_with(kVersion) || answer.size() < kVersion.size() + 4) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::isdigit(static_cast<unsigned char>(answer[kVersion.size() + i])) == 0) return false;
  }
  return answer[kVersion.size()] >= '1' && answer[kVersion.size()] <= '5';
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Target target;
  const std::string answer = target.answer_to({reinterpret_cast<const char*>(data), size});
  if (!answer.empty() && !is_status_line(answer)) complain("no HTTP: " + answer.substr(0, 100));
  target.check_folder();
  return 0;
}
