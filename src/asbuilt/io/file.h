// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// The whole content of a file. Errors: unreadable_input (missing, a folder, no permission).
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// The content of a file without a copy of it where that matters: files from 64 MB on are mapped, so that the pages
/// that were read can leave memory again. Whoever cuts such a file short while it is read ends the program, as with any
/// map.
class FileContent {
 public:
  /// Errors: unreadable_input, as read_file.
  [[nodiscard]] static Result<FileContent> open(const std::filesystem::path& path);

  FileContent(FileContent&& other) noexcept;
  FileContent& operator=(FileContent&& other) noexcept;
  FileContent(const FileContent&) = delete;
  FileContent& operator=(const FileContent&) = delete;
  ~FileContent();

  [[nodiscard]] std::string_view view() const {
    return map_ == nullptr ? std::string_view(copy_) : std::string_view(static_cast<const char*>(map_), size_);
  }

 private:
  FileContent() = default;

  std::string copy_;
  void* map_ = nullptr;
  std::size_t size_ = 0;
};

/// Writes a file whole or not at all: a temporary beside it, fsync, then rename. Errors: unwritable_output.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view content);

/// SHA-256 of a content, as 64 hexadecimal digits (FIPS 180-4).
[[nodiscard]] std::string sha256(std::string_view content);

}  // namespace asbuilt::io
