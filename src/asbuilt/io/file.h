// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "asbuilt/core/result.h"
#include "asbuilt/io/file_map.h"

namespace asbuilt::io {

/// The whole content of a file. Errors: unreadable_input (missing, a folder, no permission).
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// The content of a file without a copy of it where that matters: files from 64 MB on are mapped, so that the pages
/// that were read can leave memory again. Where such a file is cut short while it is read, zeros take the place of what
/// is gone; who has read it asks `whole` whether what came out is worth anything.
class FileContent {
 public:
  /// Errors: unreadable_input, as read_file.
  [[nodiscard]] static Result<FileContent> open(const std::filesystem::path& path);

  [[nodiscard]] std::string_view view() const { return map_ ? map_->view() : std::string_view(copy_); }

  /// Errors: unreadable_input if the file was cut short since it was opened.
  [[nodiscard]] Result<void> whole() const;

 private:
  FileContent() = default;

  std::string name_, copy_;
  std::optional<FileMap> map_;
};

/// Writes a file whole or not at all: a temporary beside it, fsync, then rename. Errors: unwritable_output.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view content);

/// SHA-256 of a content, as 64 hexadecimal digits (FIPS 180-4).
[[nodiscard]] std::string sha256(std::string_view content);

}  // namespace asbuilt::io
