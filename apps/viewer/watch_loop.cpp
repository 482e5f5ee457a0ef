// SPDX-License-Identifier: Apache-2.0
#include "watch_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "asbuilt/live/folder_watch.h"
#include "asbuilt/live/state.h"

namespace asbuilt::viewer {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using live::FileEvent;

constexpr std::chrono::milliseconds kPoll{100}, kRetry{3000}, kRetryWithoutRoom{60000};
constexpr std::uintmax_t kLittleRoom = 64U << 20U, kNoRoom = 256U << 10U;

std::uintmax_t room_in(const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  return error ? 0 : space.available;
}

/// What threads of the server ask for, and what the folder's watcher found, until the session's thread takes it.
class Inbox {
 public:
  void put(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
      interrupt_.request_stop();
    }
    changed_.notify_all();
  }
  /// The next task, or nothing after the timeout.
  std::function<void()> take(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return !tasks_.empty(); });
    if (tasks_.empty()) return {};
    auto task = std::move(tasks_.front());
    tasks_.pop_front();
    return task;
  }
  /// Stopped as soon as there is something to do.
  std::stop_token until_next() {
    const std::lock_guard lock(mutex_);
    interrupt_ = std::stop_source();
    if (!tasks_.empty()) interrupt_.request_stop();
    return interrupt_.get_token();
  }
  void interrupt() {
    const std::lock_guard lock(mutex_);
    interrupt_.request_stop();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  std::stop_source interrupt_;
};

class Loop {
 public:
  Loop(live::LiveSession& session, const WatchOptions& options, std::stop_token stop)
      : session_(session), options_(options), stop_(std::move(stop)), output_(session.state()->output) {}

  Result<void> run(const WatchReports& reports) {
    ASBUILT_TRY(watch, live::FolderWatch::open(options_.watch, options_.settle));
    ASBUILT_TRY(server, Server::start(content_of(session_), options_.watch, options_.server,
                                      {[this](const std::string& file) { return take_out(file); },
                                       [this](const std::string& file) { return restore(file); },
                                       [this] { inbox_.put([this] { write_result(); }); }}));
    session_.on_change = [&](const std::shared_ptr<const live::LiveState>& state) {
      server->state_changed();
      if (reports.state) reports.state(*state);
    };
    if (reports.started) reports.started(*server);
    session_.set_watch(options_.watch.string());
    keep_present();
    const std::stop_callback wake(stop_, [this] { inbox_.put([] {}); });
    std::thread watcher([&] { watch_folder(watch); });
    work();
    watcher.join();
    session_.set_phase("ended");
    session_.on_change = nullptr;
    return {};
  }

 private:
  void watch_folder(live::FolderWatch& watch) {
    bool lost = false;
    while (!stop_.stop_requested()) {
      for (const FileEvent& event : watch.wait(kPoll)) {
        inbox_.put([this, event] { take(event); });
      }
      if (watch.is_lost() == lost) continue;
      lost = watch.is_lost();
      inbox_.put([this, lost] { tell_of_folder(lost); });
    }
  }

  void work() {
    auto last_task = Clock::now();
    while (!stop_.stop_requested()) {
      if (watched_is_full_) tell_of_watched_disk();
      if (auto task = inbox_.take(kPoll)) {
        task();
        last_task = Clock::now();
      } else if (is_time_to_try_again()) {
        for (const std::string& file : std::set<std::string>(waiting_)) take({FileEvent::Kind::ready, file});
      } else if (session_.refinement_is_due() && Clock::now() - last_task > options_.idle) {
        refine();
        last_task = Clock::now();
      }
    }
    while (auto task = inbox_.take(std::chrono::milliseconds(0))) task();  // what had come before the end
  }

  void keep_present() {
    std::vector<std::string> present;
    std::error_code error;
    for (fs::directory_iterator entry(options_.watch, error), end; !error && entry != end; entry.increment(error)) {
      present.push_back(entry->path().filename().string());
    }
    if (const auto kept = session_.keep_only(present); !kept) session_.note("bad", "", kept.error().message);
  }

  void take(const FileEvent& event) {
    Result<void> done;
    if (event.kind == FileEvent::Kind::ignored) {
      session_.note("info", event.file, fmt::format("{} is ignored: it is no scan by its name", event.file));
    } else if (event.kind == FileEvent::Kind::gone) {
      waiting_.erase(event.file);
      done = session_.remove(event.file);
    } else if (std::error_code error; fs::is_regular_file(options_.watch / event.file, error)) {
      done = session_.add((options_.watch / event.file).string());
    }
    if (stop_.stop_requested()) return;
    tell_of_watched_disk();
    if (!done && event.kind == FileEvent::Kind::ready) {
      waiting_.insert(event.file);
      last_failure_ = Clock::now();
      room_at_failure_ = room_in(output_);
      why_waiting_ = done.error().message;
    } else if (!done) {
      session_.note("bad", event.file, done.error().message);
    } else if (waiting_.erase(event.file) > 0) {
      session_.note("info", event.file, fmt::format("{} is stored after all", event.file));
    }
    tell_of_waiting();
  }

  /// Where the disk was full, as soon as there is more room than there was: to judge a scan takes its time.
  [[nodiscard]] bool is_time_to_try_again() const {
    const auto waited = Clock::now() - last_failure_;
    if (waiting_.empty() || waited < kRetry) return false;
    return room_at_failure_ > kLittleRoom || room_in(output_) > room_at_failure_ || waited > kRetryWithoutRoom;
  }

  void tell_of_waiting() {
    if (waiting_ == was_waiting_) return;
    for (const std::string& file : waiting_) {
      if (was_waiting_.contains(file)) continue;
      session_.note("bad", file, fmt::format("{} could not be stored and waits: {}", file, why_waiting_));
    }
    was_waiting_ = waiting_;
    if (waiting_.empty()) return session_.end_trouble("storing");
    const std::string who =
        waiting_.size() == 1 ? *waiting_.begin() + " waits" : fmt::format("{} files wait", waiting_.size());
    if (room_at_failure_ < kLittleRoom) {
      session_.set_trouble(
          "storing",
          {fmt::format("The disk is full: {}.", who),
           fmt::format("Make room on the disk of {} and it goes on by itself; nothing is lost.", output_.string())});
    } else {
      session_.set_trouble("storing", {fmt::format("The session's folder cannot be written: {}.", who),
                                       fmt::format("{}. It is tried again; nothing is lost.", why_waiting_)});
    }
  }

  /// The file that filled it was cut short by whoever wrote it.
  void tell_of_watched_disk() {
    std::error_code error;
    if (!fs::exists(options_.watch, error)) return;
    const bool is_full = room_in(options_.watch) < kNoRoom;
    if (is_full == watched_is_full_) return;
    watched_is_full_ = is_full;
    if (!is_full) return session_.end_trouble("watched disk");
    session_.set_trouble("watched disk", {"The disk of the watched folder is full.",
                                          "The last scan may have been cut short: make room and save it again."});
  }

  void tell_of_folder(bool lost) {
    if (!lost) {
      session_.end_trouble("folder");
      return session_.note("info", "", "the watched folder is back");
    }
    session_.set_trouble("folder", {"The watched folder is gone.", fmt::format("{} is looked for until it is back; "
                                                                               "the scans so far are safe.",
                                                                               options_.watch.string())});
    session_.note("bad", "", "the watched folder is gone; it is looked for until it is back");
  }

  void refine() {
    const std::stop_token interrupted = inbox_.until_next();
    const std::stop_callback end(stop_, [this] { inbox_.interrupt(); });
    const auto refined = session_.refine_jointly(interrupted);
    if (!refined) session_.note("bad", "", "the joint refinement failed: " + refined.error().message);
  }

  bool take_out(const std::string& file) {
    const auto state = session_.state();
    if (std::ranges::none_of(state->scans, [&](const live::ScanState& scan) { return scan.file == file; })) {
      return false;
    }
    inbox_.put([this, file] {
      const auto done = session_.take_out(file);
      if (!done) session_.note("bad", file, fmt::format("{} could not be taken out: {}", file, done.error().message));
    });
    return true;
  }

  bool restore(const std::string& file) {
    const auto state = session_.state();
    if (std::ranges::find(state->removed, file) == state->removed.end()) return false;
    inbox_.put([this, file] {
      const auto done = session_.restore(file);
      if (!done) {
        return session_.note("bad", file, fmt::format("{} could not be taken in: {}", file, done.error().message));
      }
      take({FileEvent::Kind::ready, file});
    });
    return true;
  }

  void write_result() {
    const auto written = session_.write_result(stop_);
    if (!written) session_.note("bad", "", "the result could not be written: " + written.error().message);
  }

  live::LiveSession& session_;
  const WatchOptions& options_;
  std::stop_token stop_;
  Inbox inbox_;
  fs::path output_;
  std::set<std::string> waiting_, was_waiting_;  // files that could not be stored; those that the page tells of
  std::string why_waiting_;
  std::uintmax_t room_at_failure_ = 0;
  bool watched_is_full_ = false;
  Clock::time_point last_failure_;
};

}  // namespace

Content content_of(const live::LiveSession& session) {
  return {[&session] { return session.state()->revision; },
          [&session] {
            const auto state = session.state();
            return std::pair(state->revision, live::to_json(*state));
          },
          [&session] { return live::to_json(*session.values()); }, live::to_json(session.surface())};
}

Result<void> run_watch(live::LiveSession& session, const WatchOptions& options, const WatchReports& reports,
                       std::stop_token stop) {
  return Loop(session, options, std::move(stop)).run(reports);
}

}  // namespace asbuilt::viewer
