// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/folder_watch.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <utility>

#include "asbuilt/io/file_kind.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kEvents = IN_CREATE | IN_MODIFY | IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE |
                                  IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR;
constexpr int kUnclosedFactor = 10;

bool is_valid_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t more = byte < 0x80                   ? 0
                             : byte >= 0xc2 && byte < 0xe0 ? 1
                             : byte >= 0xe0 && byte < 0xf0 ? 2
                             : byte >= 0xf0 && byte < 0xf5 ? 3
                                                           : 4;
    if (more == 4 || i + more >= text.size()) return false;
    for (std::size_t k = 1; k <= more; ++k) {
      if ((static_cast<unsigned char>(text[i + k]) & 0xc0) != 0x80) return false;
    }
    i += more + 1;
  }
  return true;
}

}  // namespace

bool is_scan_name(std::string_view file) {
  constexpr std::size_t kLongest = 200;
  if (file.empty() || file.size() > kLongest || file.front() == '.' || file.back() == '~') return false;
  const bool has_bad = std::ranges::any_of(file, [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f || c == '/' || c == '\\';
  });
  if (has_bad || !is_valid_utf8(file)) return false;
  std::string extension = fs::path(file).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(c < 0x80 ? std::tolower(c) : c); });
  if (extension == ".gz") {
    extension = fs::path(file).stem().extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return static_cast<char>(c < 0x80 ? std::tolower(c) : c); });
  }
  if (extension == ".png") return true;  // depth images
  const auto kind = io::kind_from_extension(extension);
  return kind && !io::is_cad(*kind);
}

Result<FolderWatch> FolderWatch::open(const fs::path& folder, std::chrono::milliseconds settle) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return fail(ErrorCode::unreadable_input,
                fmt::format("{}: {}; --watch names the folder in which scans arrive", folder.string(),
                            fs::exists(folder, error) ? "is no folder" : "there is no such folder"));
  }
  FolderWatch watch(folder, settle);
  if (watch.start()) return watch;
  return fail(ErrorCode::unreadable_input,
              fmt::format("{}: cannot be watched: {}", folder.string(), std::strerror(errno)));
}

FolderWatch::FolderWatch(FolderWatch&& other) noexcept
    : folder_(std::move(other.folder_)),
      settle_(other.settle_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      lost_(other.lost_),
      watched_(other.watched_),
      candidates_(std::move(other.candidates_)),
      known_(std::move(other.known_)),
      told_(std::move(other.told_)),
      pending_(std::move(other.pending_)) {}

FolderWatch::~FolderWatch() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FolderWatch::start() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (descriptor_ < 0 || ::inotify_add_watch(descriptor_, folder_.c_str(), kEvents) < 0) return false;
  lost_ = false;
  watched_ = identity().value_or(Identity{});
  list_folder();  // after the watch began, so that nothing falls between the two
  return true;
}

std::optional<FolderWatch::Identity> FolderWatch::identity() const {
  struct stat found {};
  if (::stat(folder_.c_str(), &found) != 0 || !S_ISDIR(found.st_mode)) return std::nullopt;
  return Identity{found.st_dev, found.st_ino};
}

// A disk that is put over the watched folder, or taken off, tells nobody who watches what lies under it.
void FolderWatch::look_for_folder() {
  const auto found = identity();
  if (!found || *found != watched_) lost_ = true;
  if (!lost_ || !found) return;
  std::error_code error;
  const bool is_left_behind = found->device != watched_.device && !known_.empty() && fs::is_empty(folder_, error);
  if (!is_left_behind && !start()) lost_ = true;
}

// Also when events were lost (the queue is finite): what is there, and what is no longer.
void FolderWatch::list_folder() {
  std::set<std::string> present;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code of_file;
    if (!entry->is_regular_file(of_file)) continue;
    present.insert(entry->path().filename().string());
  }
  for (const std::string& file : present) touched(file, false);  // a known one may have changed meanwhile
  const std::set<std::string> before = known_;
  for (const std::string& file : before) {
    if (!present.contains(file)) vanished(file);
  }
}

void FolderWatch::touched(const std::string& file, bool closed) {
  if (file.empty()) return;
  std::error_code error;
  if (!is_scan_name(file)) {
    const bool is_private = file.front() == '.' || fs::is_directory(folder_ / file, error);
    if (!is_private && told_.insert(file).second) pending_.push_back({FileEvent::Kind::ignored, file});
    return;
  }
  Candidate& candidate = candidates_[file];
  candidate.size = fs::file_size(folder_ / file, error);
  candidate.time = fs::last_write_time(folder_ / file, error);
  candidate.since = Clock::now();
  candidate.closed = closed;
}

void FolderWatch::vanished(const std::string& file) {
  candidates_.erase(file);
  told_.erase(file);
  if (known_.erase(file) > 0) pending_.push_back({FileEvent::Kind::gone, file});
}

void FolderWatch::read_events() {
  alignas(inotify_event) std::array<char, 16384> buffer;
  for (;;) {
    const ssize_t size = ::read(descriptor_, buffer.data(), buffer.size());
    if (size <= 0) return;
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      if ((event->mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_IGNORED | IN_UNMOUNT)) != 0) lost_ = true;
      if ((event->mask & IN_Q_OVERFLOW) != 0) list_folder();
      if (event->len == 0 || (event->mask & IN_ISDIR) != 0) continue;
      const std::string file(event->name);
      if ((event->mask & (IN_DELETE | IN_MOVED_FROM)) != 0) {
        vanished(file);
      } else {
        touched(file, (event->mask & (IN_CLOSE_WRITE | IN_MOVED_TO)) != 0);
      }
    }
  }
}

void FolderWatch::take_settled(std::vector<FileEvent>& events) {
  const auto now = Clock::now();
  for (auto candidate = candidates_.begin(); candidate != candidates_.end();) {
    const auto& [file, state] = *candidate;
    const auto needed = state.closed ? settle_ : kUnclosedFactor * settle_;
    if (now - state.since < needed) {
      ++candidate;
      continue;
    }
    std::error_code no_size, no_time;
    const auto size = fs::file_size(folder_ / file, no_size);
    const auto time = fs::last_write_time(folder_ / file, no_time);
    if (no_size || no_time) {
      candidate = candidates_.erase(candidate);  // gone again; its own event tells
    } else if (size != state.size || time != state.time) {
      touched((candidate++)->first, state.closed);
    } else {
      events.push_back({FileEvent::Kind::ready, file});
      known_.insert(file);
      candidate = candidates_.erase(candidate);
    }
  }
}

std::vector<FileEvent> FolderWatch::wait(std::chrono::milliseconds timeout) {
  const auto until = Clock::now() + timeout;
  std::vector<FileEvent> events;
  for (;;) {
    look_for_folder();
    read_events();
    events = std::exchange(pending_, {});
    take_settled(events);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (!events.empty() || left.count() <= 0) return events;
    const auto step =
        candidates_.empty() && !lost_ ? left : std::min(left, std::max(settle_ / 3, std::chrono::milliseconds(5)));
    pollfd waiting{descriptor_, POLLIN, 0};
    ::poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(1, step.count())));
  }
}

}  // namespace asbuilt::live
