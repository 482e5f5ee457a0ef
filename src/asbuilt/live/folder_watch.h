// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::live {

/// What happened to a file of the folder.
struct FileEvent {
  enum class Kind {
    ready,    ///< there, whole as far as can be told: closed after writing or moved here, and its size stands still
    gone,     ///< deleted or moved away
    ignored,  ///< no scan by its name, told once
  };
  Kind kind = Kind::ready;
  std::string file;  ///< name within the folder

  bool operator==(const FileEvent&) const = default;
};

/// Whether a file of this name can be a scan: not hidden, not on its way (.part, .tmp, ...), with an extension that
/// scans have, and a name that the protocol can carry.
[[nodiscard]] bool is_scan_name(std::string_view file);

/// Watches one folder with inotify; what lies there already comes first, by name. A file is ready when it was closed
/// by its writer or moved here and kept size and time for `settle`; a file that nobody closes (a network share
/// does not tell) when it kept them for ten times as long. Subfolders are not looked into.
class FolderWatch {
 public:
  /// Errors: unreadable_input (no such folder, not a folder, no more watches to be had).
  [[nodiscard]] static Result<FolderWatch> open(const std::filesystem::path& folder,
                                                std::chrono::milliseconds settle = std::chrono::milliseconds(60));
  FolderWatch(FolderWatch&& other) noexcept;
  FolderWatch& operator=(FolderWatch&&) = delete;
  ~FolderWatch();

  /// Waits up to `timeout` for events; empty if there were none. Ready files in order of name.
  [[nodiscard]] std::vector<FileEvent> wait(std::chrono::milliseconds timeout);

  /// Whether the folder itself is gone (deleted, moved, its disk taken off); looked for again at every wait. The empty
  /// folder that a disk leaves behind is not taken for it: the files of a disk that is off are not deleted.
  [[nodiscard]] bool is_lost() const { return lost_; }

 private:
  struct Candidate {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type time;
    std::chrono::steady_clock::time_point since;
    bool closed = false;
  };

  FolderWatch(std::filesystem::path folder, std::chrono::milliseconds settle)
      : folder_(std::move(folder)), settle_(settle) {}
  struct Identity {
    std::uint64_t device = 0, inode = 0;
    bool operator==(const Identity&) const = default;
  };

  [[nodiscard]] bool start();
  [[nodiscard]] std::optional<Identity> identity() const;
  void look_for_folder();
  void read_events();
  void list_folder();
  void touched(const std::string& file, bool closed);
  void vanished(const std::string& file);
  void take_settled(std::vector<FileEvent>& events);

  std::filesystem::path folder_;
  std::chrono::milliseconds settle_;
  int descriptor_ = -1;
  bool lost_ = false;
  Identity watched_;  // what was watched last under this path
  std::map<std::string, Candidate> candidates_;
  std::set<std::string> known_, told_;
  std::vector<FileEvent> pending_;
};

}  // namespace asbuilt::live
