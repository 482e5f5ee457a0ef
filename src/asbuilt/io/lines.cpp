// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/lines.h"

#include <algorithm>

namespace asbuilt::io {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

bool LineCursor::next() {
  if (next_ >= text_.size()) return false;
  const std::size_t end = text_.find('\n', next_);
  ended_ = end != std::string_view::npos;
  line_ = text_.substr(next_, (ended_ ? end : text_.size()) - next_);
  next_ = ended_ ? end + 1 : text_.size();
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  ++number_;
  return true;
}

bool LineCursor::next_with_content() {
  while (next()) {
    if (!std::ranges::all_of(line_, is_blank)) return true;
  }
  return false;
}

std::string_view WordCursor::next() {
  std::size_t begin = 0;
  while (begin < rest_.size() && is_blank(rest_[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest_.size() && !is_blank(rest_[end])) ++end;
  const std::string_view word = rest_.substr(begin, end - begin);
  rest_.remove_prefix(end);
  return word;
}

std::string_view WordCursor::rest() {
  while (!rest_.empty() && is_blank(rest_.front())) rest_.remove_prefix(1);
  return rest_;
}

}  // namespace asbuilt::io
