// SPDX-License-Identifier: Apache-2.0
#include "apart.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <optional>
#include <string_view>

namespace asbuilt::bench {
namespace {

constexpr char kDone = 'd', kThrew = 't';  // the first byte that the child sends

void send(int pipe, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(pipe, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

// _exit: nothing that the parent has open or registered is to be flushed or torn down twice.
[[noreturn]] void work_and_leave(int pipe, const std::function<std::string()>& work) {
  try {
    send(pipe, kDone + work());
  } catch (const std::exception& error) {
    send(pipe, kThrew + std::string(error.what()));
  } catch (...) {
    send(pipe, std::string(1, kThrew));
  }
  _exit(0);
}

// All that the child sends until it closes the pipe; nothing when the time is up.
std::optional<std::string> received(int pipe, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  std::string bytes;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waiting{pipe, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::clamp<long>(left, 0, 1000)));
    if (ready < 0 && errno != EINTR) return bytes;
    if (ready <= 0 && left <= 0) return std::nullopt;
    if (ready <= 0) continue;
    char buffer[4096];
    const ssize_t count = read(pipe, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(buffer, static_cast<std::size_t>(count));
  }
}

}  // namespace

Result<std::string> run_apart(double seconds, const std::function<std::string()>& work) {
  int ends[2] = {};
  if (pipe(ends) != 0) return fail(ErrorCode::not_possible, fmt::format("no pipe: {}", std::strerror(errno)));
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // whoever stops the suite stops this, too
    work_and_leave(ends[1], work);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return fail(ErrorCode::not_possible, fmt::format("no process: {}", std::strerror(errno)));
  }
  const std::optional<std::string> bytes = received(ends[0], seconds);
  close(ends[0]);
  if (!bytes) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!bytes) return fail(ErrorCode::not_possible, fmt::format("gave no result within {:g} s", seconds));
  if (WIFSIGNALED(status)) {
    return fail(ErrorCode::not_possible, fmt::format("crashed ({})", strsignal(WTERMSIG(status))));
  }
  if (bytes->empty()) return fail(ErrorCode::not_possible, "left without a result");
  if (bytes->front() == kThrew) return fail(ErrorCode::not_possible, fmt::format("threw: {}", bytes->substr(1)));
  return bytes->substr(1);
}

}  // namespace asbuilt::bench
