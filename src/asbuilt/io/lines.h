// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace asbuilt::io {

/// Steps through a text line by line; a line ends with LF or CR LF.
class LineCursor {
 public:
  explicit LineCursor(std::string_view text, std::size_t begin = 0, std::size_t lines_before = 0)
      : text_(text), next_(begin), number_(lines_before) {}

  /// Steps to the next line; false at the end of the text.
  bool next();
  /// Steps to the next line that holds more than blanks.
  bool next_with_content();

  [[nodiscard]] std::string_view line() const { return line_; }  ///< without its end
  [[nodiscard]] std::size_t number() const { return number_; }   ///< 1 for the first line
  [[nodiscard]] std::size_t end() const { return next_; }        ///< the byte after the line and its end
  /// False for a last line without a line end: it may have been cut off within its last value.
  [[nodiscard]] bool is_ended() const { return ended_; }

 private:
  std::string_view text_, line_;
  std::size_t next_, number_;
  bool ended_ = true;
};

/// Steps through the words of a line, parted by blanks and tabs.
class WordCursor {
 public:
  explicit WordCursor(std::string_view line) : rest_(line) {}

  /// The next word; empty at the end of the line.
  [[nodiscard]] std::string_view next();
  /// What is left of the line, without leading blanks.
  [[nodiscard]] std::string_view rest();

 private:
  std::string_view rest_;
};

}  // namespace asbuilt::io
