// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/live/next_view.h"

namespace asbuilt::live {

/// One scan file of a session as it lies on disk.
struct StoredFile {
  std::string file;  ///< name within the watched folder
  std::filesystem::path folder;
  io::RunRecord record;                ///< what `asbuilt detect` writes for this file alone
  std::optional<SensorLimits> limits;  ///< what it showed of its sensor
  std::uint64_t order = 0;             ///< of arrival
};

/// The session on disk: DIR/scans/FILE/ is a complete `detect` run of each file, made under another name and renamed
/// into place, so that it is there whole or not at all; DIR/live.json remembers what was taken out.
class ScanStore {
 public:
  /// Removes what an interrupted session left unfinished, and reads the rest. A folder that cannot be read is taken
  /// away (its scan will be judged again) and named in `lost`. The folder is this store's as long as it lives, or its
  /// program. Errors: unwritable_output (also: another program works in it), unreadable_input (live.json).
  [[nodiscard]] static Result<ScanStore> open(const std::filesystem::path& folder, std::vector<std::string>& lost);

  /// In canonical order: by file name, bytewise.
  [[nodiscard]] const std::map<std::string, StoredFile>& files() const { return files_; }

  /// Where the run of a file is made before it is committed; empty and new.
  [[nodiscard]] Result<std::filesystem::path> begin(const std::string& file);
  /// Puts it in place of what there was. Errors: unwritable_output; then nothing has changed.
  [[nodiscard]] Result<void> commit(const std::string& file, io::RunRecord record, std::optional<SensorLimits> limits);
  /// Gives up what was begun and frees its room on the disk.
  void abandon();
  [[nodiscard]] Result<void> erase(const std::string& file);

  /// Files that were taken out, with the sha256 of the content that stays out.
  [[nodiscard]] const std::map<std::string, std::string>& removed() const { return removed_; }
  [[nodiscard]] Result<void> set_removed(const std::string& file, std::optional<std::string> sha256);

 private:
  [[nodiscard]] std::filesystem::path folder_of(const std::string& file) const { return folder_ / "scans" / file; }

  std::filesystem::path folder_;
  std::shared_ptr<const int> lock_;  // descriptor; closed with the last owner
  std::map<std::string, StoredFile> files_;
  std::map<std::string, std::string> removed_;
  std::uint64_t next_order_ = 0;
};

}  // namespace asbuilt::live
