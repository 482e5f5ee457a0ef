// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace asbuilt::io {

/// A file that is mapped to be read, and that another program may cut short meanwhile: what is gone then reads as
/// zeros, and was_cut_short() tells. (Without that guard the system would end the program by SIGBUS. The handler for it
/// is put in place with the first map; faults elsewhere go on to the handler that was there before.)
class FileMap {
 public:
  /// Nothing where the file cannot be mapped, or where as many maps as the guard can watch are open.
  [[nodiscard]] static std::optional<FileMap> open(int descriptor, std::size_t size);

  FileMap(FileMap&& other) noexcept;
  FileMap& operator=(FileMap&& other) noexcept;
  FileMap(const FileMap&) = delete;
  FileMap& operator=(const FileMap&) = delete;
  ~FileMap();

  [[nodiscard]] std::string_view view() const { return {begin_, size_}; }
  [[nodiscard]] bool was_cut_short() const;

 private:
  FileMap(const char* begin, std::size_t size, std::size_t slot) : begin_(begin), size_(size), slot_(slot) {}

  const char* begin_ = nullptr;
  std::size_t size_ = 0, slot_ = 0;
};

/// Lets the pages of a map leave memory that have been read; does nothing for bytes that are not in a map. They come
/// back from the file when they are asked for again.
void release_pages(std::string_view read);

}  // namespace asbuilt::io
